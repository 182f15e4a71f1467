#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

/// Timing that survives a busy machine: all contenders take turns, and what counts is the ratio of
/// two contenders within one round.
namespace compare {

struct Contender {
    std::string name;
    std::function<void()> run;
};

/// A median and its quartiles.
struct Summary {
    double median = 0, lower = 0, upper = 0;
};

/// Of one value or more.
[[nodiscard]] Summary summary_of(std::vector<double> values);

/// What a turn is timed with. The processor's time leaves out what other programs took, but adds up
/// the threads.
enum class Clock { processor, wall };

struct Effort {
    int rounds = 15;
    /// A turn repeats its contender for about this long.
    double turn_seconds = 3e-3;
    /// For contenders on one thread; those on several need the other.
    Clock clock = Clock::processor;
    /// A turn begins with one call that is not timed and brings its buffers into the caches.
    bool untimed_call = true;
};

class Times {
public:
    /// Runs every contender once per round, one after the other.
    Times(const std::vector<Contender>& contenders, const Effort& effort);

    /// Seconds per call.
    [[nodiscard]] Summary seconds(std::size_t contender) const;
    /// Of the fastest round.
    [[nodiscard]] double least_seconds(std::size_t contender) const;
    /// The time of one over the time of another, round by round.
    [[nodiscard]] Summary ratio(std::size_t one, std::size_t other) const;

private:
    std::vector<std::vector<double>> seconds_;  ///< by contender and round
};

}  // namespace compare
