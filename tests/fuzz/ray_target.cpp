// The target for the ray files of `castor trace --rays`.
#include "castor/error.h"
#include "cli/ray_file.h"
#include "fuzz/targets.h"
#include "support/temporary_directory.h"

namespace castor::fuzz {

void run_rays(std::string_view bytes) {
    static const test::TemporaryDirectory kFolder;
    try {
        const std::vector<Ray> rays = cli::read_rays(kFolder.write("a.rays", bytes));
        require(rays.size() * sizeof(Ray) == bytes.size(), "every ray of the file is read");
    } catch (const Error&) {
        require(bytes.size() % sizeof(Ray) != 0, "a file of whole rays is read");
    }
}

std::vector<std::string> ray_seeds() {
    const Ray rays[2] = {};
    return {std::string(reinterpret_cast<const char*>(rays), sizeof rays), ""};
}

}  // namespace castor::fuzz
