#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace report {

/// What an axis is to a calibration.
enum class AxisKind : std::uint8_t {
    quality,  ///< costs time and buys precision: the row of the defaults may choose it as well
    costly,   ///< costs time for another reason: each value is tuned by itself
    free      ///< costs about nothing: searched
};

/// A parameter and the values that are tried.
struct Axis {
    std::string name;
    AxisKind kind = AxisKind::free;
    double standard = 0;  ///< what the library takes when it is not told, one of `values`
    std::vector<double> values;
    /// What the values are called, one for each; empty for numbers.
    std::vector<std::string> labels{};
};

/// One value for each axis.
using Setting = std::vector<double>;

/// The settings from which a search starts: every combination of the values on the axes of the kinds
/// asked for, and the standard value on the others. The first axis changes slowest.
[[nodiscard]] std::vector<Setting> starts(const std::vector<Axis>& axes, bool costly);

/// A setting and what it brings.
struct Candidate {
    Setting setting;
    double error = 0;
    double time = 0;  ///< nanoseconds per pixel
};

/// The setting of the least error that can be reached from `start` by changing free axes: all values of
/// one axis after the other, then one step along the first axis and another at once, round after round
/// until a whole one gains less than a thousandth. The same steps for the same errors. No setting is
/// asked for twice.
[[nodiscard]] Candidate tune(const std::vector<Axis>& axes, const Setting& start,
                             const std::function<double(const Setting&)>& error);

/// Drops candidates that are clearly beaten: others that are no worse take less than `margin` of their
/// time, or are as quick and the same.
[[nodiscard]] std::vector<Candidate> worth_timing(std::vector<Candidate> candidates, double margin);

/// Which of the candidates has the least error of those that take no longer than the budget; of equals
/// the quicker. None may be quick enough.
[[nodiscard]] std::optional<std::size_t> best_within(std::span<const Candidate> candidates,
                                                     double budget);

/// What a budget buys.
struct Choice {
    double budget = 0;
    Candidate tuned, standard;  ///< `error` on the views of the search
    double held_out_error = 0, standard_held_out_error = 0;
};

/// The best of the candidates for each budget that both can meet; settings of the defaults stand for
/// tuned ones too. Only what was chosen is looked at on the views that were held out, once.
[[nodiscard]] std::vector<Choice> choices(
    const std::vector<Candidate>& tuned, const std::vector<Candidate>& standard,
    std::span<const double> budgets, const std::function<double(const Setting&)>& held_out_error);

}  // namespace report
