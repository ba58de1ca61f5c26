#pragma once

#include <mpi.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/team.h"
#include "mpi_transport.h"
#include "remote/manager.h"
#include "remote/rank_server.h"
#include "startup.h"

namespace castor::mpi {

/// The ranks of an MPI job. Rank 0 leads. Collective calls are made until the scene is shared, and none afterwards, so
/// that nothing waits for a rank that is gone.
class MpiTeam : public cli::Team {
public:
    /// MPI must be initialised.
    MpiTeam();
    ~MpiTeam() override;
    MpiTeam(const MpiTeam&) = delete;
    MpiTeam& operator=(const MpiTeam&) = delete;

    bool leads() const override { return transport_->rank() == 0; }
    std::string host() const override;
    Traffic traffic() const override { return transport_->traffic(); }
    SceneShare scene_share() const override {
        return {static_cast<std::uint32_t>(transport_->rank()), static_cast<std::uint32_t>(transport_->rank_count())};
    }
    void share_scene(const cli::SceneInput& scene, const std::string& file) override;
    Manager& gather(const std::vector<Device>& devices, double deadline_seconds, bool quiet) override;
    std::optional<cli::SceneInput> receive_scene() override;
    RankServer& introduce(const std::vector<Device>& devices, const std::vector<Warning>& warnings,
                          const std::string& failure, double deadline_seconds) override;

    /// When the command has ended, however: the leader lets the others end. Returns whether all end; if not, MPI cannot
    /// be finalised.
    bool end();
    /// Whether a device did not end with its work: the process is then better ended without waiting for drivers.
    bool has_left_workers_behind() const { return server_ && server_->has_left_workers_behind(); }

private:
    /// What the leader tells of the scene at first.
    struct Announcement {
        std::uint32_t is_given_up;
        std::uint32_t path_bytes;  // of a saved scene that all may see; 0: there is none
        std::uint64_t file_bytes, head_checksum;
    };

    std::string spread_file(const std::string& source);
    bool is_first_of_host() const { return host_.rank() == 0; }

    Collective all_, host_, first_of_hosts_;
    std::unique_ptr<MpiTransport> transport_;
    std::unique_ptr<Manager> manager_;
    std::unique_ptr<RankServer> server_;
    bool is_scene_shared_ = false;
};

}  // namespace castor::mpi
