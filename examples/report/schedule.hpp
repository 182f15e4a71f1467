#pragma once

#include <string>
#include <vector>

#include "options.hpp"
#include "structures.hpp"
#include "subject.hpp"

namespace report {

/// How long cells take, before they are measured: from a look at the speed of rays in each scene, and
/// from what cells that are done took.
class Schedule {
public:
    explicit Schedule(const Options& options) : options_{options} {}

    /// A part of the run with what it should take, in seconds.
    void add(double seconds) { left_ += seconds; }
    /// A cell should take as many seconds.
    [[nodiscard]] double seconds_of(const Cell& cell, Structures& structures,
                                    nook::ThreadExecutor& threads);
    /// A part that should have taken `expected` took `seconds`.
    void done(double expected, double seconds);
    /// What is left, in seconds, at the speed so far.
    [[nodiscard]] double left() const;

private:
    const Options& options_;
    const Subject* subject_ = nullptr;  ///< whose speed is known
    double ray_ = 0;                    ///< seconds, all threads
    double left_ = 0, expected_ = 0, taken_ = 0;
};

/// "40 s", "12 min", "1 h 20 min".
[[nodiscard]] std::string duration(double seconds);

}  // namespace report
