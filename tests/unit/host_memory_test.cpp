#include "base/host_memory.h"

#include <filesystem>
#include <limits>
#include <string>

#include "support/catch.h"
#include "support/temporary_directory.h"

using castor::available_host_memory;
using castor::test::TemporaryDirectory;

namespace {

/// Files as the kernel shows them, in a folder.
class FakeRoot {
public:
    void write(const std::string& name, const std::string& text) const {
        std::filesystem::create_directories((directory_.path() / name).parent_path());
        directory_.write(name, text);
    }
    std::uint64_t available() const { return available_host_memory(directory_.path()); }

private:
    TemporaryDirectory directory_;
};

}  // namespace

TEST_CASE("this machine has memory", "[memory]") {
    const std::uint64_t available = available_host_memory();
    CHECK(available > (1u << 20));
    CHECK(available < std::numeric_limits<std::uint64_t>::max());
}

TEST_CASE("available memory is the least of the machine's and the control groups'", "[memory]") {
    const FakeRoot root;
    CHECK(root.available() == std::numeric_limits<std::uint64_t>::max() / 1024 * 1024);
    root.write("proc/meminfo",
               "MemTotal:       24683668 kB\nMemFree:        18930768 kB\nMemAvailable:   1000 kB\nBuffers: 1 kB\n");
    CHECK(root.available() == 1'024'000);

    SECTION("version 2, limits of groups above") {
        root.write("proc/self/cgroup", "0::/user/me\n");
        root.write("sys/fs/cgroup/user/me/memory.max", "max\n");
        root.write("sys/fs/cgroup/user/me/memory.current", "5000\n");
        CHECK(root.available() == 1'024'000);
        root.write("sys/fs/cgroup/user/memory.max", "100000\n");
        root.write("sys/fs/cgroup/user/memory.current", "40000\n");
        CHECK(root.available() == 60'000);
        root.write("sys/fs/cgroup/user/memory.stat", "anon 30000\nfile 10000\ninactive_file 10000\n");
        CHECK(root.available() == 70'000);
        root.write("sys/fs/cgroup/user/memory.current", "400000\n");
        CHECK(root.available() == 0);
    }
    SECTION("version 1, in a container") {
        root.write("proc/self/cgroup", "9:name=systemd:/\n4:cpu,cpuacct:/x\n4:memory:/not/there\n0::/\n");
        root.write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
        root.write("sys/fs/cgroup/memory/memory.usage_in_bytes", "1000\n");
        CHECK(root.available() == 1'024'000);
        root.write("sys/fs/cgroup/memory/memory.limit_in_bytes", "3000\n");
        root.write("sys/fs/cgroup/memory/memory.stat", "total_inactive_file 600\n");
        CHECK(root.available() == 2600);
    }
    SECTION("nonsense is no limit") {
        root.write("proc/self/cgroup", "\n:\n::\nx:memory\n4:memory:x\n");
        CHECK(root.available() == 1'024'000);
    }
}
