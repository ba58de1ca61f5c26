#pragma once

namespace castor::cli {

/// The program's exit status; `castor --help` lists the values.
enum class ExitStatus {
    done = 0,
    defect = 1,         // an error that nobody foresaw
    usage = 2,          // an unknown option, word, device or file type, or a number out of range
    input = 3,          // the scene, a mesh, a ray file or a checkpoint is wrong
    device = 4,         // the device failed or there is none, or memory ran out
    file = 5,           // a file cannot be written
    interrupted = 130,  // 128 + SIGINT, as in shells
};

}  // namespace castor::cli
