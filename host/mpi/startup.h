#pragma once

#include <mpi.h>

#include <cstddef>
#include <filesystem>
#include <span>

namespace castor::mpi {

/// Waits for a request, with pauses, so that the processor is left to others. Throws DeviceError after so many seconds,
/// naming `what` was waited for.
void wait(MPI_Request& request, double seconds, const char* what);

/// Collective calls of the start, with deadlines. All ranks of a communicator must call them in the same order.
struct Collective {
    MPI_Comm communicator;
    double deadline_seconds;

    void broadcast(void* data, std::size_t bytes, int root = 0) const;
    template <class T>
    void broadcast(T& value, int root = 0) const {
        broadcast(static_cast<void*>(&value), sizeof(T), root);
    }
    /// Returns whether `value` is true on all ranks.
    bool all(bool value) const;
    void barrier() const;
    int rank() const;
};

}  // namespace castor::mpi
