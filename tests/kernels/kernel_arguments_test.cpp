#include "opencl/kernel_arguments.h"

#include <fmt/format.h>

#include <concepts>
#include <string>
#include <type_traits>
#include <vector>

#include "render/render_arguments.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "trace/strategy.h"
#include "trace/trace_arguments.h"

namespace castor {

std::ostream& operator<<(std::ostream& stream, const ArgumentInfo& info) {
    return stream << (info.is_const ? "const " : "") << (info.is_buffer ? "global " : "") << info.type << ' '
                  << info.name;
}

}  // namespace castor

namespace castor::test {
namespace {

// One column in the place of another does not compile, neither as an argument nor by assignment, although both hold
// float4; nor does a missing argument.
static_assert(
    std::convertible_to<DeviceColumn<columns::surface_normal>, ColumnArgument<columns::surface_normal, false>>);
static_assert(
    !std::convertible_to<DeviceColumn<columns::surface_position>, ColumnArgument<columns::surface_normal, false>>);
static_assert(
    !std::constructible_from<ColumnArgument<columns::surface_normal, false>, DeviceColumn<columns::surface_position>>);
static_assert(!std::convertible_to<cl::Buffer, ColumnArgument<columns::surface_normal, false>>);
static_assert(!std::assignable_from<DeviceColumn<columns::surface_normal>&, DeviceColumn<columns::surface_position>>);
static_assert(!std::is_default_constructible_v<ColumnArgument<columns::hits, true>>);
static_assert(!std::is_default_constructible_v<ValueArgument<shared::uint>>);
static_assert(!std::convertible_to<int, ValueArgument<shared::uint>>);
static_assert(!std::is_default_constructible_v<TraceColumns>);

/// The pointer to elements of a column of a wave.
std::string element_of(const std::string& column) {
#define CASTOR_ELEMENT_OF(name, host, device, per) \
    if (column == #name) return #device "*";
    CASTOR_WAVE_COLUMNS(CASTOR_ELEMENT_OF)
#undef CASTOR_ELEMENT_OF
    return "";
}

std::vector<ArgumentInfo> arguments_of(cl::Kernel& kernel) {
    std::vector<ArgumentInfo> infos;
    for (cl_uint i = 0; i < kernel.getInfo<CL_KERNEL_NUM_ARGS>(); ++i) {
        const auto address = kernel.getArgInfo<CL_KERNEL_ARG_ADDRESS_QUALIFIER>(i);
        const auto qualifiers = kernel.getArgInfo<CL_KERNEL_ARG_TYPE_QUALIFIER>(i);
        const bool is_buffer = address == CL_KERNEL_ARG_ADDRESS_GLOBAL;
        if (!is_buffer) CHECK(address == CL_KERNEL_ARG_ADDRESS_PRIVATE);
        // The parameter of a value may be const, which is nobody's business.
        infos.push_back({kernel.getArgInfo<CL_KERNEL_ARG_NAME>(i), kernel.getArgInfo<CL_KERNEL_ARG_TYPE_NAME>(i),
                         is_buffer, is_buffer && (qualifiers & CL_KERNEL_ARG_TYPE_CONST)});
        // Some drivers count the terminating zero.
        while (!infos.back().name.empty() && infos.back().name.back() == '\0') infos.back().name.pop_back();
        while (!infos.back().type.empty() && infos.back().type.back() == '\0') infos.back().type.pop_back();
        // CASTOR_READ and CASTOR_WRITE of wave_columns.h give a parameter its column's own name for the element.
        if (infos.back().type == infos.back().name + "_element*") infos.back().type = element_of(infos.back().name);
    }
    return infos;
}

void check_arguments(DeviceContext& context, const std::vector<ArgumentInfo>& expected, const std::string& program,
                     const std::string& name, const std::string& options = "") {
    cl::Kernel kernel = context.kernel_of(program, name, options + " -cl-kernel-arg-info");
    CAPTURE(program, name);
    CHECK(arguments_of(kernel) == expected);
}

template <class Arguments>
void check_arguments(DeviceContext& context) {
    check_arguments(context, Arguments::describe(), Kernel<Arguments>::program(context),
                    Kernel<Arguments>::name(context));
}

template <class Arguments>
void check_trace_arguments(DeviceContext& context,
                           std::initializer_list<const char*> strategies = {"brute", "simt", "wide", "packet"}) {
    for (const char* strategy : strategies)
        check_arguments(context, Arguments::describe(), fmt::format("{}_{}", Arguments::kProgram, strategy),
                        fmt::format("{}_{}", Arguments::kQuery, strategy),
                        Arguments::kCountsWork ? "-DCASTOR_COUNT_WORK=1"
                        : Arguments::kHasTimes ? "-DCASTOR_HAS_MOTION=1"
                                               : "");
}

}  // namespace

TEST_CASE("kernels have the arguments that their structs set", "[kernels]") {
    DeviceContext context(test_device());
    check_arguments<FindSurface>(context);
    check_arguments<FindTexturedSurface>(context);
    check_arguments<TextureBackground>(context);
    check_arguments<GenerateRays>(context);
    check_arguments<DrawTimes>(context);
    check_arguments<MoveRays>(context);
    check_arguments<MoveSurfaces>(context);
    check_arguments<Shade>(context);
    check_arguments<GenerateShadowRays>(context);
    check_arguments<Accumulate>(context);
    check_arguments<Scatter>(context);
    check_arguments<FindBaseColors>(context);
    check_arguments<ShadePaths>(context);
    check_arguments<LimitSamples>(context);
    check_arguments<RankPaths>(context);
    check_arguments<CompactPaths>(context);
    check_arguments<ListBranches>(context);
    check_arguments<TakeBranches>(context);
    check_arguments<AddBranches>(context);
    check_arguments<AddSamples>(context);
    check_arguments<AddFeatures>(context);
    check_arguments<Resolve>(context);
    check_arguments<WriteAovs>(context);
    check_arguments<FindUvs>(context);
    check_arguments<FindAttributes>(context);
    check_arguments<FindPassed>(context);
    check_arguments<GoOnBeyond>(context);
}

TEST_CASE("trace kernels have the arguments that their structs set", "[kernels]") {
    DeviceContext context(test_device());
    check_trace_arguments<ClosestHit>(context);
    check_trace_arguments<AnyHit>(context);
    check_trace_arguments<TimedClosestHit>(context);
    check_trace_arguments<TimedAnyHit>(context);
    check_trace_arguments<CountedClosestHit>(context);
    check_trace_arguments<CountedAnyHit>(context);
    check_trace_arguments<CountCrossings>(context, {"brute", "simt", "wide"});
    check_trace_arguments<ListCrossings>(context, {"brute", "simt", "wide"});
}

}  // namespace castor::test
