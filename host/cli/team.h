#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "castor/device.h"
#include "castor/error.h"
#include "castor/scene_share.h"
#include "exit_status.h"
#include "interrupt.h"
#include "memory_options.h"
#include "remote/rank_server.h"
#include "remote/transport.h"
#include "report.h"
#include "scene_input.h"

namespace castor {
class Manager;
}  // namespace castor

namespace castor::cli {

/// The processes that work on one command together, as one of them sees them. The first one leads: it reads and writes
/// files, and manages the work. A command that works alone has no team.
class Team {
public:
    virtual ~Team() = default;
    virtual bool leads() const = 0;
    virtual std::string host() const = 0;  // the name of this process's computer
    /// What this process exchanged with the others so far, without the scene.
    virtual Traffic traffic() const = 0;
    /// Returns this process's share of a scene that the team divides.
    virtual SceneShare scene_share() const = 0;

    // For the leader, in this order:

    /// Gives the scene to all, which must be built: by its file, if all see the same one, else a copy of it. `file`:
    /// what SCENE names; empty: the scene is another one by now.
    virtual void share_scene(const SceneInput& scene, const std::string& file) = 0;
    /// Waits until the others are ready, and tells who takes part.
    virtual Manager& gather(const std::vector<Device>& devices, double deadline_seconds, bool quiet) = 0;

    // For the others:

    /// Waits for the leader's scene. Returns nullopt where it gave up.
    virtual std::optional<SceneInput> receive_scene() = 0;
    /// Introduces this process and its devices. `warnings`: what the leader is to tell. `failure`: why it cannot work;
    /// empty: it can.
    virtual RankServer& introduce(const std::vector<Device>& devices, const std::vector<Warning>& warnings,
                                  const std::string& failure, double deadline_seconds) = 0;
};

/// Adds the option with which a team divides the scene.
inline void add_distribute_option(CLI::App& command, bool& distributes) {
    command.add_flag("--distribute-scene", distributes,
                     "each process keeps some chunks of the scene, and rays travel: for scenes that fit no computer's "
                     "memory");
}

/// Makes the scene ready for devices, and if there is a team gives it to all, divided if `distributes`. For the leader.
/// `programs` are built meanwhile, unless the scene is to be divided.
inline void prepare_scene(SceneInput& input, const std::string& file, const std::vector<Device>& devices,
                          const BuildOptions& options, Team* team, bool distributes, bool quiet,
                          const ProgramsOfScene& programs = {}) {
    input.build(devices, options, quiet, distributes ? ProgramsOfScene() : programs);
    if (!team) return;
    const std::size_t shares = team->scene_share().count;
    const bool is_cut = distributes && shares > 1 && input.divide(devices, options, shares, quiet);
    team->share_scene(input, is_cut ? std::string() : file);
}

/// What a process of a team that does not lead does for a command: gets the scene, makes a `User` of it (a Renderer or
/// a Tracer) by `make(scene_input, devices)`, and lets `serve(user, scene, server)` work for the leader until the end.
/// Whatever fails here is told, and the leader does without this process.
template <class User, class Make, class Serve>
ExitStatus serve_team(Team& team, const std::string& device_words, const DeviceLimits& device_limits,
                      double deadline_seconds, const Make& make, const Serve& serve) {
    catch_interrupts();
    std::optional<SceneInput> input;
    std::vector<Device> devices;
    std::optional<User> user;
    std::string failure;
    try {
        input = team.receive_scene();
        if (!input) return ExitStatus::done;
        devices = select_devices(device_words, device_limits, team.host());
        user.emplace(make(*input, devices));
    } catch (const Error& error) {
        failure = error.what();
        devices.clear();
    }
    RankServer& server =
        team.introduce(devices, user ? user->warnings() : std::vector<Warning>(), failure, deadline_seconds);
    try {
        if (user) serve(*user, input->scene, server);
    } catch (const Error& error) {
        note("castor-mpi: {}", error.what());
    }
    server.finish();
    return server.is_told_the_end() ? ExitStatus::done : ExitStatus::device;
}

}  // namespace castor::cli
