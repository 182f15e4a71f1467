#pragma once

#include <chrono>
#include <ctime>
#include <vector>

#include "options.hpp"
#include "results.hpp"
#include "subject.hpp"

/// The parts. Each prints what it found and adds to the results.
namespace compare {

/// PMI and the occlusion of the same pictures without a matrix.
void measure_stream(const Options& options, Subject& subject, Results& results);

/// The whole channel, and measures over it.
void measure_matrix(const Options& options, Subject& subject, Results& results);

/// How far the map of PMI changes with the next level of viewpoints.
void measure_refinement(const Options& options, Subject& subject, Results& results);

/// What a call takes.
struct Elapsed {
    double wall = 0;       ///< seconds
    double processor = 0;  ///< of all threads: leaves out what other programs took
};

template <class Call>
[[nodiscard]] Elapsed time_of(const Call& call)
{
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t before = std::clock();
    call();
    return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
            double(std::clock() - before) / CLOCKS_PER_SEC};
}

}  // namespace compare
