// Targets for the files of sections: built scenes and checkpoints. Their checksums would keep almost every changed file
// from being looked at. So an input is either a file as it stands, or a packed one, of which a file with right
// checksums is made: for each section its name and its type's name, each with a zero at the end, the bytes of an
// element (one byte), the bytes of the section (two, little-endian), and the section.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <deque>

#include "base/section_file.h"
#include "castor/error.h"
#include "fuzz/targets.h"
#include "render/checkpoint.h"
#include "support/temporary_directory.h"
#include "trace/saved_scene.h"

namespace castor::fuzz {

namespace {

constexpr std::string_view kMagic("CASTOR\x1a\n");
constexpr std::size_t kMostPacked = 256;  // sections

const test::TemporaryDirectory& folder() {
    static const test::TemporaryDirectory kFolder;
    return kFolder;
}

/// The text up to the next zero; both are taken away.
std::string take_text(std::string_view& bytes) {
    constexpr std::size_t kLongest = 31;
    const std::size_t end = std::min(bytes.find('\0'), bytes.size());
    const std::string text(bytes.substr(0, std::min(end, kLongest)));
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
    return text;
}

std::size_t take_number(std::string_view& bytes, std::size_t size) {
    std::size_t number = 0;
    for (std::size_t i = 0; i < size && !bytes.empty(); ++i, bytes.remove_prefix(1))
        number |= std::size_t{static_cast<unsigned char>(bytes.front())} << (8 * i);
    return number;
}

/// Writes the file that an input describes.
std::filesystem::path unpack(std::string_view bytes, const SectionFileKind& kind) {
    const std::filesystem::path file = folder().path() / "sections";
    if (bytes.starts_with(kMagic)) return folder().write("sections", bytes);
    std::deque<std::string> names;
    std::vector<Section> sections;
    while (!bytes.empty() && sections.size() < kMostPacked) {
        const std::string& name = names.emplace_back(take_text(bytes));
        const std::string& type = names.emplace_back(take_text(bytes));
        const std::size_t element_bytes = std::max<std::size_t>(take_number(bytes, 1), 1);
        const std::size_t wanted = take_number(bytes, 2);
        const std::size_t size = std::min(wanted, bytes.size()) / element_bytes * element_bytes;
        sections.push_back({name, {type, element_bytes}, std::as_bytes(std::span(bytes.substr(0, size)))});
        bytes.remove_prefix(size);
    }
    write_section_file(file, kind, sections);
    return file;
}

std::string text_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

/// Packs a file of sections; section_file.h tells how such a file is laid out.
std::string pack(const std::filesystem::path& file) {
    constexpr std::size_t kHeadBytes = 72, kEntryBytes = 96, kNameBytes = 32, kCountAt = 24;
    const std::string bytes = text_of(file);
    const auto number_at = [&](std::size_t at) {
        std::uint64_t number = 0;
        std::memcpy(&number, bytes.data() + at, sizeof number);
        return number;
    };
    std::string packed;
    for (std::uint64_t i = 0; i < number_at(kCountAt); ++i) {
        const std::size_t at = kHeadBytes + i * kEntryBytes;
        const std::uint64_t element_bytes = number_at(at + 64), offset = number_at(at + 72), count = number_at(at + 80);
        for (const std::size_t name : {at, at + kNameBytes}) packed += std::string(bytes.data() + name) + '\0';
        const std::uint64_t size = element_bytes * count;
        packed += {static_cast<char>(element_bytes), static_cast<char>(size), static_cast<char>(size >> 8)};
        packed += bytes.substr(offset, size);
    }
    return packed;
}

Scene small_scene(bool with_instances) {
    Scene scene;
    scene.materials.resize(2);
    scene.lights.resize(1);
    scene.cameras.resize(1);
    scene.warnings.push_back({"scene.xml", 3, "something"});
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}};
    mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
    scene.meshes.push_back(mesh);
    compute_smooth_normals(mesh);
    scene.meshes.push_back(mesh);
    scene.spheres.push_back({{2, 0, 0}, 0.5f, 1});
    scene.planes.push_back({{0, -1, 0}, {0, 1, 0}, 1});
    if (!with_instances) return scene;
    MeshInstance instance;
    instance.transform[3] = {3, 0, 0};
    scene.instances.push_back(instance);
    return scene;
}

Checkpoint small_checkpoint() {
    Checkpoint checkpoint;
    checkpoint.picture = "size 9 10\nsamples 4\n";
    Film& film = checkpoint.film;
    film.width = 9;
    film.height = 10;
    film.samples_per_pixel = 4;
    film.pixels.assign(90, glm::vec3(1.0f));
    film.done.assign(90, 0);
    for (std::size_t y = 0; y < 8; ++y) std::fill_n(film.done.begin() + static_cast<std::ptrdiff_t>(9 * y), 8, 1);
    checkpoint.partial_blocks[1].samples = 2;
    film.planes.push_back({"depth", {"Z"}, std::vector<float>(90), {}});
    film.planes.push_back({"primitive", {"I"}, {}, std::vector<std::uint32_t>(90)});
    return checkpoint;
}

}  // namespace

void run_built_scene(std::string_view bytes) {
    try {
        map_saved_scene(unpack(bytes, kBuiltSceneFile));
    } catch (const Error&) {
    }
}

std::vector<std::string> built_scene_seeds() {
    std::vector<std::string> seeds;
    const std::filesystem::path file = folder().path() / "seed";
    for (const bool with_instances : {false, true}) {
        const std::vector<StrategyChoice> strategies{StrategyChoice::all(Strategy::wide),
                                                     StrategyChoice::all(Strategy::simt)};
        save_scene(file, build_scene(small_scene(with_instances), strategies));
        seeds.push_back(pack(file));
    }
    save_scene(file, build_scene(Scene{}, {}));
    seeds.push_back(text_of(file));
    return seeds;
}

void run_checkpoint(std::string_view bytes) {
    const std::filesystem::path file = unpack(bytes, kCheckpointFile);
    try {
        const CheckpointSummary summary = summarize_checkpoint(file);
        require(summary.pixels_done <= summary.pixels(), "no more pixels are done than there are");
        require(summary.samples_done <= summary.samples(), "no more samples are done than there are");
        Checkpoint expected = small_checkpoint();
        expected.film.width = summary.width;
        expected.film.height = summary.height;
        expected.film.samples_per_pixel = summary.samples_per_pixel;
        for (FilmPlane& plane : expected.film.planes) {
            plane.values.resize(plane.values.empty() ? 0 : summary.pixels());
            plane.indices.resize(plane.indices.empty() ? 0 : summary.pixels());
        }
        load_checkpoint(file, expected);
    } catch (const Error&) {
    }
}

std::vector<std::string> checkpoint_seeds() {
    const std::filesystem::path file = folder().path() / "seed";
    save_checkpoint(file, small_checkpoint());
    return {pack(file), text_of(file)};
}

}  // namespace castor::fuzz
