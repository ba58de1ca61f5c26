#pragma once

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/temporary_directory.h"

extern char** environ;

namespace castor::test {

using Environment = std::vector<std::pair<std::string, std::string>>;

/// A finished program's output. `status` is its exit status, or 128 + the signal that ended it.
struct ProcessResult {
    int status = -1;
    std::string out;
    std::string err;
};

/// Starts a program with its output and error streams on the given descriptors. Returns the process's number.
inline pid_t start_process(const std::vector<std::string>& command, int out, int err, const Environment& changes = {},
                           const std::string& folder = "") {
    std::vector<std::string> variables;
    for (char** variable = environ; *variable; ++variable) variables.emplace_back(*variable);
    for (const auto& [name, value] : changes) {
        std::erase_if(variables, [&](const std::string& v) { return v.starts_with(name + "="); });
        variables.push_back(name + "=" + value);
    }
    const auto pointers = [](const std::vector<std::string>& texts) {
        std::vector<char*> result;
        for (const std::string& text : texts) result.push_back(const_cast<char*>(text.c_str()));
        result.push_back(nullptr);
        return result;
    };
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, err, STDERR_FILENO);
    if (!folder.empty()) posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    pid_t process = 0;
    const int failure = ::posix_spawn(&process, command.front().c_str(), &actions, nullptr, pointers(command).data(),
                                      pointers(variables).data());
    posix_spawn_file_actions_destroy(&actions);
    if (failure != 0) throw std::runtime_error("cannot start " + command.front());
    return process;
}

/// Waits for the end of a process. Returns its status as ProcessResult has it.
inline int wait_for(pid_t process) {
    int status = 0;
    ::waitpid(process, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

inline std::string file_contents(const std::filesystem::path& file) {
    std::ifstream input(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(input), {}};
}

/// Runs a program to its end, in `folder` if one is given.
inline ProcessResult run_process(const std::vector<std::string>& command, const Environment& changes = {},
                                 const std::string& folder = "") {
    const TemporaryDirectory streams;
    const std::filesystem::path out_file = streams.path() / "out", err_file = streams.path() / "err";
    const int out = ::open(out_file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    const int err = ::open(err_file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    const pid_t process = start_process(command, out, err, changes, folder);
    ProcessResult result;
    result.status = wait_for(process);
    ::close(out);
    ::close(err);
    result.out = file_contents(out_file);
    result.err = file_contents(err_file);
    return result;
}

}  // namespace castor::test
