#include "marks.hpp"

#include <cstdio>

#include "table.hpp"

namespace compare {

const char* text_of(Verdict verdict)
{
    switch (verdict) {
    case Verdict::stretch: return "met, stretch too";
    case Verdict::met: return "met";
    case Verdict::within_slack: return "met within 15 %";
    case Verdict::missed: return "NOT MET";
    case Verdict::reported: return "reported";
    case Verdict::not_measured: break;
    }
    return "not measured";
}

Verdict Mark::verdict() const
{
    if (!measured) return Verdict::not_measured;
    // Above 1: better than the goal.
    const auto margin = [&](double goal) {
        return at_least ? value.median / goal : goal / value.median;
    };
    if (stretch > 0 && margin(stretch) >= 1) return Verdict::stretch;
    if (target <= 0) return Verdict::reported;
    if (margin(target) >= 1) return Verdict::met;
    return margin(target) * (1 + slack) >= 1 ? Verdict::within_slack : Verdict::missed;
}

void Mark::take(const Summary& candidate, const std::string& place)
{
    const bool worse = at_least ? candidate.median < value.median : candidate.median > value.median;
    if (measured && !worse) return;
    measured = true;
    value = candidate;
    where = place;
}

void print_marks(const std::vector<Mark>& marks, bool quick)
{
    std::printf("Marks: the worst case counts; a goal missed by up to %.0f %% counts as noise.\n",
                100 * slack);
    if (quick) std::printf("This was a quick run: the times mean nothing.\n");
    const auto goal = [](double value) { return digits(value < 1 ? "%.3f" : "%.2f", value); };
    std::vector<std::vector<std::string>> rows{
        {"mark", "measured", "worst at", "goal", "stretch", "verdict"}};
    for (const Mark& mark : marks) {
        const std::string sign = mark.at_least ? "≥ " : "≤ ";
        rows.push_back({mark.what, mark.measured ? text_of(mark.value) : "-",
                        mark.where.empty() ? "-" : mark.where,
                        mark.target > 0 ? sign + goal(mark.target) : "-",
                        mark.stretch > 0 ? sign + goal(mark.stretch) : "-",
                        text_of(mark.verdict())});
    }
    print_table(rows);
}

}  // namespace compare
