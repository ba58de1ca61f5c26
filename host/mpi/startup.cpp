#include "startup.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <climits>
#include <thread>

#include "base/stopwatch.h"
#include "castor/error.h"

namespace castor::mpi {

void wait(MPI_Request& request, double seconds, const char* what) {
    const Stopwatch watch;
    for (int done = 0;;) {
        if (MPI_Test(&request, &done, MPI_STATUS_IGNORE) != MPI_SUCCESS)
            throw DeviceError("", "", 0, fmt::format("MPI failed at {}", what));
        if (done) return;
        if (watch.seconds() > seconds)
            throw DeviceError(
                "", "", 0,
                fmt::format("MPI has not come to an end of {} within {:g} s: a host hangs, or is gone", what, seconds));
        std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
}

void Collective::broadcast(void* data, std::size_t bytes, int root) const {
    constexpr std::size_t kPiece = std::size_t{1} << 24;
    for (std::size_t done = 0; done < bytes; done += kPiece) {
        MPI_Request request = MPI_REQUEST_NULL;
        MPI_Ibcast(static_cast<std::byte*>(data) + done, static_cast<int>(std::min(kPiece, bytes - done)), MPI_BYTE,
                   root, communicator, &request);
        wait(request, deadline_seconds, "sharing the scene");
    }
}

bool Collective::all(bool value) const {
    int mine = value, everyones = 0;
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Iallreduce(&mine, &everyones, 1, MPI_INT, MPI_MIN, communicator, &request);
    wait(request, deadline_seconds, "agreeing on the scene");
    return everyones != 0;
}

void Collective::barrier() const {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Ibarrier(communicator, &request);
    wait(request, deadline_seconds, "sharing the scene on a host");
}

int Collective::rank() const {
    int rank = 0;
    MPI_Comm_rank(communicator, &rank);
    return rank;
}

}  // namespace castor::mpi
