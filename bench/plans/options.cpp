#include "options.hpp"

#include <charconv>
#include <system_error>

#include "compare/failure.hpp"

namespace compare {

namespace {

constexpr const char* part_names[] = {"open", "scenes", "whole", "traced", "outlines"};

constexpr const char* help =
    "Usage: nook-plan-compare [SCENE]... [OPTIONS]\n"
    "What plans leave out and what they cost: every kernel with the map of its planner\n"
    "against itself without, the planning included, in rotation in one process; beside a\n"
    "pass that reads the inputs and writes ones. One thread. Prints times, their ratios\n"
    "within a round, what was left out, what that changed, and which of the project's\n"
    "marks are met. A scene is a built-in one or an OBJ file [those of the marks].\n"
    "The status is 1 when an exact plan changed a bit of a picture.\n"
    "\n"
    "  --scene NAME    the same as SCENE\n"
    "  --tolerance T   how far tolerant plans may let visibility rise, 0 to 1 [0.01]\n"
    "  --target NAME   the instruction set: SSE2, AVX2 or AVX-512 [the best of this CPU]\n"
    "  --pictures DIR  draw the plans into the folder DIR\n"
    "  --rounds N      rounds of every rotation, 1 to 10000 [15; 3 with --quick]\n"
    "  --only PART     open, scenes, whole, traced or outlines; may be repeated [all]\n"
    "  --quick         small images: shows that everything runs, not how fast\n"
    "  --json FILE     write the results to FILE too\n"
    "  --help          print this and leave\n"
    "  --version       print the version and leave\n";

double share(Arguments& arguments)
{
    const std::string text = arguments.value();
    double result = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), result);
    if (error != std::errc{} || end != text.data() + text.size() || !(result >= 0 && result <= 1))
        throw Failure{arguments.word() + ": '" + text.substr(0, 60) +
                      "' is not a number from 0 to 1"};
    return result;
}

std::string name(Arguments& arguments)
{
    const std::string text = arguments.value();
    if (text.empty()) throw Failure{arguments.word() + ": an empty name"};
    return text;
}

}  // namespace

bool read_options(int argc, const char* const* argv, Options& options)
{
    return read_common(argc, argv, {help, part_names, 15, 3}, options, [&](Arguments& arguments) {
        const std::string& word = arguments.word();
        if (word == "--scene") options.subjects.push_back(name(arguments));
        else if (word == "--tolerance") options.tolerance = share(arguments);
        else if (word == "--target") options.target = name(arguments);
        else if (word == "--pictures") options.pictures = name(arguments);
        else if (!arguments.is_option() && !word.empty()) options.subjects.push_back(word);
        else arguments.unknown();
    });
}

}  // namespace compare
