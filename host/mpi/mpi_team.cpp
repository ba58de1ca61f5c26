#include "mpi_team.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <thread>

#include "base/checksum.h"
#include "base/mapped_file.h"
#include "base/stopwatch.h"
#include "castor/error.h"
#include "castor/renderer.h"
#include "cli/interrupt.h"
#include "cli/phase.h"
#include "cli/report.h"
#include "doctor/golden_picture.h"

namespace castor::mpi {

namespace {

namespace fs = std::filesystem;

// How long the others wait for the leader, which reads and builds the scene.
constexpr double kBuildSeconds = 24 * 3600.0;

// How long all wait for each other at any other point of the start: to send a piece of the scene, or to check it.
constexpr double kStartSeconds = 120.0;

// How long the leader is silent at least before it counts as gone: it may be writing a large picture.
constexpr double kLeaderSeconds = 60.0;

// How long the others have to say goodbye.
constexpr double kEndSeconds = 10.0;

/// What tells saved scenes apart: their heads have the checksums of all that follows.
struct FileMark {
    std::uint64_t bytes = 0, head_checksum = 0;
    bool operator==(const FileMark&) const = default;
};

std::optional<FileMark> mark_of(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    std::string head(4096, '\0');
    stream.read(head.data(), static_cast<std::streamsize>(head.size()));
    head.resize(static_cast<std::size_t>(stream.gcount()));
    std::error_code error;
    const auto bytes = fs::file_size(file, error);
    if (head.empty() || error) return std::nullopt;
    return FileMark{bytes, checksum(head)};
}

/// A new, empty file on this host, for what lives as long as this job. Throws FileError.
std::string make_temporary_file() {
    std::error_code error;
    const fs::path folder = fs::temp_directory_path(error);
    std::string name = (folder / "castor-scene-XXXXXX").string();
    const int file = ::mkstemp(name.data());
    if (file < 0) throw FileError(name, std::system_category().message(errno));
    ::close(file);
    return name;
}

/// Removes a file at the end of its life, whatever happens.
struct FileRemover {
    std::string file;
    ~FileRemover() {
        std::error_code ignored;
        if (!file.empty()) fs::remove(file, ignored);
    }
};

/// What all ranks must have in common: pictures are the same bits only then.
std::string version() {
    return fmt::format("castor {}, {}-endian, golden picture {:016x}", CASTOR_VERSION,
                       std::endian::native == std::endian::little ? "little" : "big", doctor::kGoldenChecksum);
}

/// Returns why a device is not to be trusted; empty: it makes the golden picture.
std::string fault_of(const Device& device) {
    try {
        const Scene scene = doctor::golden_scene();
        Renderer renderer(scene, {device});
        const std::uint64_t found =
            doctor::film_checksum(renderer.render(scene.cameras.front(), doctor::golden_options()));
        if (found == doctor::kGoldenChecksum) return {};
        return fmt::format(
            "its golden picture has the checksum {:016x}, and must have {:016x}; castor doctor tells more", found,
            doctor::kGoldenChecksum);
    } catch (const Error& error) {
        return error.what();
    }
}

Collective make_collective(MPI_Comm communicator) {
    if (communicator != MPI_COMM_NULL) MPI_Comm_set_errhandler(communicator, MPI_ERRORS_RETURN);
    return {communicator, kStartSeconds};
}

MPI_Comm duplicate(MPI_Comm communicator) {
    MPI_Comm copy = MPI_COMM_NULL;
    MPI_Comm_dup(communicator, &copy);
    return copy;
}

MPI_Comm ranks_of_host() {
    MPI_Comm host = MPI_COMM_NULL;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &host);
    return host;
}

MPI_Comm first_ranks(bool is_first) {
    MPI_Comm first = MPI_COMM_NULL;
    MPI_Comm_split(MPI_COMM_WORLD, is_first ? 0 : MPI_UNDEFINED, 0, &first);
    return first;
}

/// The text of the root, on all ranks.
void broadcast(const Collective& collective, std::string& text) {
    std::uint64_t bytes = text.size();
    collective.broadcast(bytes);
    text.resize(bytes);
    collective.broadcast(text.data(), bytes);
}

}  // namespace

MpiTeam::MpiTeam()
    : all_(make_collective(duplicate(MPI_COMM_WORLD))),
      host_(make_collective(ranks_of_host())),
      first_of_hosts_(make_collective(first_ranks(host_.rank() == 0))),
      transport_(std::make_unique<MpiTransport>(make_collective(duplicate(MPI_COMM_WORLD)).communicator)) {
    if (leads()) manager_ = std::make_unique<Manager>(*transport_, version());
}

MpiTeam::~MpiTeam() = default;

std::string MpiTeam::host() const {
    std::array<char, 256> name{};
    ::gethostname(name.data(), name.size() - 1);
    return name.data();
}

void MpiTeam::share_scene(const cli::SceneInput& scene, const std::string& file) {
    is_scene_shared_ = true;
    std::string path;
    FileMark mark;
    if (!file.empty() && is_built_scene(file)) {
        path = fs::absolute(file).string();
        mark = mark_of(path).value_or(FileMark());
    }
    Announcement announcement{0, static_cast<std::uint32_t>(path.size()), mark.bytes, mark.head_checksum};
    all_.broadcast(announcement);
    broadcast(all_, path);
    if (all_.all(!path.empty())) return;
    FileRemover remover;
    if (path.empty()) {
        path = remover.file = make_temporary_file();
        scene.built->save(path);
    }
    spread_file(path);
    host_.barrier();
}

std::optional<cli::SceneInput> MpiTeam::receive_scene() {
    Announcement announcement{};
    Collective{all_.communicator, kBuildSeconds}.broadcast(announcement);
    if (announcement.is_given_up) return std::nullopt;
    std::string path;
    broadcast(all_, path);
    const FileMark mark{announcement.file_bytes, announcement.head_checksum};
    const auto load = [](const std::string& file) {
        cli::SceneInput input;
        input.built = load_built_scene(file);
        input.scene = input.built->description();
        return input;
    };
    if (all_.all(!path.empty() && mark_of(path) == mark)) return load(path);
    FileRemover remover;
    std::exception_ptr failure;
    std::optional<cli::SceneInput> input;
    try {
        const std::string file = spread_file({});
        if (is_first_of_host()) remover.file = file;
        input = load(file);
    } catch (...) {
        failure = std::current_exception();
    }
    host_.barrier();  // all of this host have mapped the file
    if (failure) std::rethrow_exception(failure);
    return input;
}

/// Copies a file of the leader's to each host that has none. Returns its name on this host.
std::string MpiTeam::spread_file(const std::string& source) {
    constexpr std::size_t kPiece = std::size_t{1} << 24;
    std::string file = source, failure;
    if (is_first_of_host()) {
        std::optional<MappedFile> mapped;
        if (leads()) mapped.emplace(source);
        std::uint64_t bytes = leads() ? mapped->bytes().size() : 0;
        first_of_hosts_.broadcast(bytes);
        std::ofstream stream;
        std::string piece;
        if (!leads()) {
            try {
                file = make_temporary_file();
                stream.open(file, std::ios::binary);
            } catch (const FileError& error) {
                failure = error.what();
            }
        }
        // Also where it cannot be written here: the others need this rank to pass it on.
        for (std::uint64_t done = 0; done < bytes; done += piece.size()) {
            const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(kPiece, bytes - done));
            piece.resize(count);
            if (leads()) piece.assign(mapped->bytes().substr(done, count));
            first_of_hosts_.broadcast(piece.data(), count);
            if (!leads() && failure.empty() && !stream.write(piece.data(), static_cast<std::streamsize>(count)).flush())
                failure =
                    fmt::format("{}: the scene cannot be written: {}", file, std::system_category().message(errno));
        }
    }
    broadcast(host_, file);
    broadcast(host_, failure);
    if (failure.empty()) return file;
    const FileRemover remover{is_first_of_host() ? file : std::string()};
    throw DeviceError("", "", 0, failure);
}

Manager& MpiTeam::gather(const std::vector<Device>& devices, double deadline_seconds, bool quiet) {
    const cli::Phase phase("waiting for the other hosts", quiet);
    for (const Device& device : devices)
        if (const std::string fault = fault_of(device); !fault.empty()) throw DeviceError(label(device), "", 0, fault);
    manager_->gather(deadline_seconds, [] { return !cli::interrupted(); });
    for (const std::string& notice : manager_->take_notices()) cli::note("warning: {}", notice);
    if (quiet) return *manager_;
    std::vector<std::string> names;
    for (const Device& device : devices) names.push_back(label(device));
    for (const RemoteWorker& worker : manager_->workers()) names.push_back(worker.name);
    cli::note("{} ranks, {} devices: {}", transport_->rank_count(), names.size(), fmt::join(names, ", "));
    return *manager_;
}

RankServer& MpiTeam::introduce(const std::vector<Device>& devices, const std::vector<Warning>& warnings,
                               const std::string& failure, double deadline_seconds) {
    RankIntroduction introduction{version(), host(), failure, {}, {}};
    for (const Device& device : devices) {
        introduction.workers.push_back(label(device));
        introduction.faults.push_back(fault_of(device));
    }
    for (const Warning& warning : warnings) introduction.warnings.push_back(warning.text);
    server_ = std::make_unique<RankServer>(*transport_, deadline_seconds, std::max(deadline_seconds, kLeaderSeconds));
    server_->introduce(introduction);
    return *server_;
}

bool MpiTeam::end() {
    if (server_ && !server_->is_told_the_end()) return false;  // the leader is gone
    bool are_all_gone = true;
    if (leads() && is_scene_shared_) {
        are_all_gone = manager_->end(kEndSeconds);
    } else if (leads()) {
        Announcement announcement{.is_given_up = 1, .path_bytes = 0, .file_bytes = 0, .head_checksum = 0};
        all_.broadcast(announcement);
    }
    const Stopwatch watch;
    while (!transport_->all_sent() && watch.seconds() < kEndSeconds)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (!are_all_gone || !transport_->all_sent()) return false;
    transport_->close();
    return true;
}

}  // namespace castor::mpi
