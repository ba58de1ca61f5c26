#include "doctor/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <optional>
#include <system_error>

#include "base/byte_count.h"
#include "base/stopwatch.h"
#include "castor/error.h"

extern char** environ;

namespace castor::doctor {

namespace {

constexpr const char* kThisProgram = "/proc/self/exe";
constexpr std::size_t kMessageBytes = 2000;

[[noreturn]] void fail(const char* what, int error) {
    throw FileError(kThisProgram, fmt::format("{}: {}", what, std::generic_category().message(error)));
}

/// Both ends of a pipe, closed in children but for what is handed to them.
struct Pipe {
    Pipe() {
        std::array<int, 2> ends;
        if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail("a pipe cannot be made", errno);
        read_end = ends[0];
        write_end = ends[1];
    }
    ~Pipe() {
        close_writing();
        ::close(read_end);
    }
    Pipe(const Pipe&) = delete;
    Pipe& operator=(const Pipe&) = delete;
    void close_writing() {
        if (write_end >= 0) ::close(write_end);
        write_end = -1;
    }

    int read_end, write_end;
};

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
}

std::vector<std::string> environment_with(const Environment& changes) {
    std::vector<std::string> variables;
    for (char** variable = environ; *variable; ++variable) variables.emplace_back(*variable);
    for (const auto& [name, value] : changes) {
        const std::string prefix = name + "=";
        std::erase_if(variables, [&](const std::string& v) { return v.starts_with(prefix); });
        variables.push_back(prefix + value);
    }
    return variables;
}

/// In a process group of its own: what a driver starts, such as a linker, ends with it.
pid_t start(std::vector<std::string> command, const Environment& changes, const Pipe& report, const Pipe& messages) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, messages.write_end, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, messages.write_end, STDERR_FILENO);
    posix_spawn_file_actions_adddup2(&actions, report.write_end, kReportDescriptor);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
    std::vector<std::string> variables = environment_with(changes);
    pid_t process = 0;
    const int error = ::posix_spawn(&process, kThisProgram, &actions, &attributes, pointers(command).data(),
                                    pointers(variables).data());
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) fail("it cannot be started again", error);
    return process;
}

/// What there is to read, without waiting; nothing at the end.
std::string read_some(int descriptor) {
    std::array<char, 4096> bytes;
    const ssize_t count = ::read(descriptor, bytes.data(), bytes.size());
    return count > 0 ? std::string(bytes.data(), static_cast<std::size_t>(count)) : std::string();
}

bool is_readable(int descriptor, int milliseconds) {
    pollfd waiting{descriptor, POLLIN, 0};
    return ::poll(&waiting, 1, milliseconds) > 0 && (waiting.revents & (POLLIN | POLLHUP));
}

/// A process of our own, ended with its group at the end of this if it has not ended before.
class Child {
public:
    explicit Child(pid_t process) : process_(process) {}
    ~Child() { end(); }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    /// As waitpid gives it, once it has ended.
    std::optional<int> status() {
        if (status_ || is_lost_) return status_;
        int status = 0;
        pid_t found;
        do found = ::waitpid(process_, &status, WNOHANG);
        while (found < 0 && errno == EINTR);
        if (found == process_) status_ = status;
        if (found < 0) is_lost_ = true;
        return status_;
    }
    /// Bytes of memory that it has; 0 if the system does not tell, or it has ended.
    std::uint64_t resident_bytes() const {
        std::uint64_t pages = 0, resident_pages = 0;
        std::ifstream(fmt::format("/proc/{}/statm", process_)) >> pages >> resident_pages;
        return resident_pages * std::uint64_t(::sysconf(_SC_PAGESIZE));
    }
    /// With what it left running. One that is stuck in the kernel cannot be ended, and is left alone.
    void end() {
        if (is_ended_) return;
        is_ended_ = true;
        ::kill(-process_, SIGKILL);
        for (const Stopwatch watch; !status() && !is_lost_ && watch.seconds() < kSecondsToDie;) ::poll(nullptr, 0, 5);
    }

private:
    static constexpr double kSecondsToDie = 5.0;

    pid_t process_;
    std::optional<int> status_;
    bool is_lost_ = false;  // somebody else has asked for its status
    bool is_ended_ = false;
};

/// The child's two streams.
class Listener {
public:
    Listener(const Pipe& report, const Pipe& messages, const std::function<void(const std::string&)>& on_line)
        : report_(report), messages_(messages), on_line_(on_line) {}

    /// Waits so long at most. Returns whether a whole line came.
    bool listen(int milliseconds) {
        std::array<pollfd, 2> waiting{pollfd{report_.read_end, POLLIN, 0},
                                      pollfd{has_messages_ ? messages_.read_end : -1, POLLIN, 0}};
        if (::poll(waiting.data(), waiting.size(), milliseconds) <= 0) return false;
        if (waiting[1].revents) {
            const std::string text = read_some(messages_.read_end);
            if (text.empty()) has_messages_ = false;
            take_message(text);
        }
        if (!waiting[0].revents) return false;
        const std::string text = read_some(report_.read_end);
        // At the end of its reports a child has to end itself: that is waited for without a rush.
        if (text.empty()) ::poll(nullptr, 0, milliseconds);
        return take_report(text);
    }

    /// Reads what is left.
    void drain() {
        for (std::string text; is_readable(report_.read_end, 0) && !(text = read_some(report_.read_end)).empty();)
            take_report(text);
        for (std::string text; is_readable(messages_.read_end, 0) && !(text = read_some(messages_.read_end)).empty();)
            take_message(text);
    }

    std::string said() && { return std::move(said_); }

private:
    bool take_report(const std::string& text) {
        line_ += text;
        bool is_whole = false;
        for (std::size_t end; (end = line_.find('\n')) != std::string::npos; is_whole = true) {
            on_line_(line_.substr(0, end));
            line_.erase(0, end + 1);
        }
        return is_whole;
    }
    void take_message(const std::string& text) {
        said_ += text;
        if (said_.size() > kMessageBytes) said_.erase(0, said_.size() - kMessageBytes);
    }

    const Pipe &report_, &messages_;
    const std::function<void(const std::string&)>& on_line_;
    std::string line_, said_;
    bool has_messages_ = true;  // there may be more
};

std::string signal_name(int signal) {
    const char* name = ::sigabbrev_np(signal);
    const char* description = ::sigdescr_np(signal);
    return name ? fmt::format("SIG{} ({})", name, description ? description : "") : fmt::format("signal {}", signal);
}

}  // namespace

std::string describe(const ChildEnd& end, const ChildLimits& limits) {
    std::string text;
    switch (end.kind) {
        case ChildEnd::Kind::exited:
            text = fmt::format("the process ended with status {}", end.code);
            break;
        case ChildEnd::Kind::signalled:
            text = fmt::format("the process was ended by {}", signal_name(end.code));
            break;
        case ChildEnd::Kind::hung:
            text = fmt::format("nothing went on for {:g} seconds, and the process was killed", limits.patience_seconds);
            break;
        case ChildEnd::Kind::too_large:
            text =
                fmt::format("the process took more than {} of memory, and was killed", byte_count(limits.memory_bytes));
            break;
        case ChildEnd::Kind::interrupted:
            return "it was interrupted";
    }
    std::string said = end.messages;
    while (!said.empty() && (said.back() == '\n' || said.back() == ' ')) said.pop_back();
    return said.empty() ? text : text + "; it said: " + said;
}

ChildEnd run_child(const std::vector<std::string>& arguments, const Environment& changes, const ChildLimits& limits,
                   const std::function<void(const std::string&)>& on_line, const std::function<bool()>& go_on) {
    constexpr int kPollMilliseconds = 100;
    Pipe report, messages;
    std::vector<std::string> command{kThisProgram};
    command.insert(command.end(), arguments.begin(), arguments.end());
    ::signal(SIGCHLD,
             SIG_DFL);  // whoever started this program may have it ignored, and then nobody hears how children end
    Child child(start(command, changes, report, messages));
    report.close_writing();
    messages.close_writing();

    Listener listener(report, messages, on_line);
    ChildEnd end;
    for (Stopwatch since_line; !child.status();) {
        if (listener.listen(kPollMilliseconds)) since_line = Stopwatch();
        if (child.status()) break;
        if (since_line.seconds() > limits.patience_seconds)
            end.kind = ChildEnd::Kind::hung;
        else if (child.resident_bytes() > limits.memory_bytes)
            end.kind = ChildEnd::Kind::too_large;
        else if (!go_on())
            end.kind = ChildEnd::Kind::interrupted;
        else
            continue;
        child.end();
        listener.drain();
        end.messages = std::move(listener).said();
        return end;
    }
    listener.drain();
    const int status = *child.status();
    end.kind = WIFEXITED(status) ? ChildEnd::Kind::exited : ChildEnd::Kind::signalled;
    end.code = WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status);
    end.messages = std::move(listener).said();
    return end;
}

}  // namespace castor::doctor
