#pragma once

#include <string>
#include <vector>

#include "options.hpp"
#include "rotation.hpp"

/// What the parts of the comparison bring home.
namespace compare {

/// The time of one contender, and against another one of the same rotation.
struct Measurement {
    std::string part, image, contender;
    int width = 0, height = 0, window = 0, threads = 1;
    Summary nanoseconds;  ///< per pixel
    std::string base;     ///< whose time `ratio` is relative to
    Summary ratio;
};

/// How far the pictures of a contender lie from nook's.
struct Agreement {
    std::string image, contender;
    int width = 0, height = 0, window = 0;
    double largest = 0;  ///< difference of visibility
    double share = 0;    ///< of pixels that differ by more than 1e-3
};

enum class Verdict { stretch, met, within_slack, missed, not_measured };
[[nodiscard]] const char* text_of(Verdict verdict);

/// Noise that a mark forgives.
inline constexpr double slack = 0.15;

/// A goal of the project, and whether it is reached.
struct Mark {
    std::string what;
    bool at_least = false;  ///< the value should be large; otherwise small
    double target = 0;
    double stretch = 0;  ///< a better goal; 0: none
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

struct Results {
    std::vector<Measurement> measurements;
    std::vector<Agreement> agreements;
    std::vector<Mark> marks;
    std::vector<Fact> facts;
};

/// "3.41 [3.30, 3.62]".
[[nodiscard]] std::string text_of(const Summary& summary);

/// Prints rows of cells, the first column to the left, the others to the right; the first row and
/// the rule below it are the head.
void print_table(const std::vector<std::vector<std::string>>& rows);

/// Prints what the numbers hang on: CPU, compiler, instruction set.
void print_machine(const Options& options);
void print_marks(const std::vector<Mark>& marks);
void write_json(const Results& results, const Options& options);

}  // namespace compare
