#include "trace/saved_scene.h"

#include <deque>
#include <string>

#include "base/section_file.h"
#include "castor/error.h"
#include "trace/check_built_scene.h"
#include "trace/scene_settings.h"

namespace castor {

namespace {

// The name of each type of column in a file.
template <class T>
constexpr std::string_view kTypeName;
template <>
constexpr std::string_view kTypeName<std::uint32_t> = "uint";
template <>
constexpr std::string_view kTypeName<glm::uvec3> = "uint3";
template <>
constexpr std::string_view kTypeName<glm::vec2> = "float2";
template <>
constexpr std::string_view kTypeName<glm::vec3> = "float3";
template <>
constexpr std::string_view kTypeName<glm::vec4> = "float4";
template <>
constexpr std::string_view kTypeName<shared::MeshRange> = "MeshRange";
template <>
constexpr std::string_view kTypeName<shared::Geometry> = "Geometry";
template <>
constexpr std::string_view kTypeName<shared::Instance> = "Instance";
template <>
constexpr std::string_view kTypeName<shared::InstanceNode> = "InstanceNode";
template <>
constexpr std::string_view kTypeName<shared::Material> = "Material";
template <>
constexpr std::string_view kTypeName<shared::VertexAttributes> = "VertexAttributes";
template <>
constexpr std::string_view kTypeName<shared::PrincipledMaterial> = "PrincipledMaterial";
template <>
constexpr std::string_view kTypeName<shared::Light> = "Light";
template <>
constexpr std::string_view kTypeName<shared::Texture> = "Texture";
template <>
constexpr std::string_view kTypeName<shared::TextureImage> = "TextureImage";
template <>
constexpr std::string_view kTypeName<shared::Emitter> = "Emitter";
template <>
constexpr std::string_view kTypeName<shared::LightNode> = "LightNode";
template <>
constexpr std::string_view kTypeName<shared::CompressedNode> = "CompressedNode";
template <>
constexpr std::string_view kTypeName<shared::WideNode> = "WideNode";
template <>
constexpr std::string_view kTypeName<shared::TriangleBlock> = "TriangleBlock";
template <>
constexpr std::string_view kTypeName<shared::SphereBlock> = "SphereBlock";

template <class T>
constexpr ElementType element_type() {
    static_assert(!kTypeName<T>.empty(), "a type of column needs a name");
    return {kTypeName<T>, sizeof(T)};
}

constexpr std::string_view kSettings = "settings";
constexpr ElementType kSettingsType{"bytes", 1};

}  // namespace

void save_scene(const std::filesystem::path& file, const SceneContents& contents, const Progress& progress) {
    const std::vector<std::byte> settings = settings_of(contents);
    std::vector<Section> sections{{kSettings, kSettingsType, settings}};
    std::deque<std::string> names;
    for_each_column_of_chunks(contents, [&]<class T>(const std::string& name, const Column<T>& column) {
        sections.push_back({names.emplace_back(name), element_type<T>(), std::as_bytes(std::span(column))});
    });
    write_section_file(file, kBuiltSceneFile, sections, progress);
}

SceneContents map_saved_scene(const std::filesystem::path& file, const Progress& progress) {
    constexpr double kReading = 0.6;  // share of the time; then the values are checked
    SectionFile sections(file, kBuiltSceneFile, progress.part(0.0, kReading));
    SceneContents contents;
    contents.file = sections.mapping();
    const std::string problem = set_settings(contents, sections.section(kSettings, kSettingsType));
    if (!problem.empty()) throw SceneError(file.string(), 0, "is damaged: its section settings " + problem);
    for_each_column_of_chunks(contents, [&]<class T>(const std::string& name, Column<T>& column) {
        const std::span<const std::byte> bytes = sections.section(name, element_type<T>());
        column = column_in_place(reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T));
    });
    sections.expect_no_more();
    contents.description.file = file.string();
    check_built_scene(contents, file.string(), progress.part(kReading, 1.0));
    return contents;
}

}  // namespace castor
