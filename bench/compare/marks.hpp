#pragma once

#include <string>
#include <vector>

#include "rotation.hpp"

/// The goals of the project, and whether they are reached.
namespace compare {

enum class Verdict { stretch, met, within_slack, missed, reported, not_measured };
[[nodiscard]] const char* text_of(Verdict verdict);

/// Noise that a mark forgives.
inline constexpr double slack = 0.15;

/// A goal of the project, and whether it is reached.
struct Mark {
    std::string what;
    bool at_least = false;  ///< the value should be large; otherwise small
    double target = 0;      ///< 0: none, the value is only reported
    double stretch = 0;     ///< a better goal; 0: none
    bool measured = false;
    Summary value{};
    std::string where{};  ///< the worst case, which is the one that counts

    [[nodiscard]] Verdict verdict() const;
    /// Takes the worse of what it has and this.
    void take(const Summary& candidate, const std::string& place);
};

/// Another number worth knowing.
struct Fact {
    std::string what;
    double value;
};

/// Prints them and how to read them.
void print_marks(const std::vector<Mark>& marks, bool quick);

}  // namespace compare
