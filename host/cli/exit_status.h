#pragma once

namespace castor::cli {

/// What the program tells its caller; `castor --help` lists them.
enum class ExitStatus {
    done = 0,
    defect = 1,         // an error that nobody foresaw
    usage = 2,          // an unknown option, word, device or file type
    input = 3,          // the scene, a mesh or the ray file is wrong
    device = 4,         // the device failed or there is none, or memory ran out
    file = 5,           // a file cannot be written
    interrupted = 130,  // 128 + SIGINT, as shells have it
};

}  // namespace castor::cli
