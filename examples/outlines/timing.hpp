#pragma once

#include <algorithm>
#include <ctime>

namespace outlines {

/// Milliseconds of this process's processor, for work on one thread.
template <class Run>
[[nodiscard]] double milliseconds(const Run& run)
{
    const std::clock_t start = std::clock();
    run();
    return 1e3 * double(std::clock() - start) / CLOCKS_PER_SEC;
}

/// The middle of three.
[[nodiscard]] inline double median(double (&times)[3])
{
    std::sort(times, times + 3);
    return times[1];
}

}  // namespace outlines
