#include "calibration_search.hpp"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

namespace report {

namespace {

constexpr int most_rounds = 8;
/// A round must bring the error below this share of what it was to be followed by another.
constexpr double worthwhile = 0.999;

/// The walk of one search over the indices of values.
class Walk {
public:
    Walk(const std::vector<Axis>& axes, const Setting& start,
         const std::function<double(const Setting&)>& error)
        : axes_{axes},
          error_{error}
    {
        for (std::size_t i = 0; i < axes.size(); ++i) {
            const auto& values = axes[i].values;
            const auto at = std::find(values.begin(), values.end(), start[i]);
            at_.push_back(static_cast<std::size_t>(at - values.begin()));
            if (axes[i].kind == AxisKind::free) free_.push_back(i);
        }
        least_ = error_at(at_);
    }

    [[nodiscard]] double least() const { return least_; }
    [[nodiscard]] Setting setting() const { return setting_of(at_); }

    void along_each_axis()
    {
        for (const std::size_t axis : free_) {
            Place next = at_;
            for (next[axis] = 0; next[axis] < axes_[axis].values.size(); ++next[axis]) look(next);
            step();
        }
    }
    /// Less of one parameter may want more of the first: a valley across the axes.
    void across_pairs()
    {
        for (std::size_t j = 1; j < free_.size(); ++j) {
            for (const int first : {-1, 1})
                for (const int second : {-1, 1}) {
                    Place next = at_;
                    if (move(next, free_[0], first) && move(next, free_[j], second)) look(next);
                }
            step();
        }
    }

private:
    using Place = std::vector<std::size_t>;

    [[nodiscard]] Setting setting_of(const Place& place) const
    {
        Setting setting;
        for (std::size_t i = 0; i < place.size(); ++i) setting.push_back(axes_[i].values[place[i]]);
        return setting;
    }
    [[nodiscard]] double error_at(const Place& place)
    {
        const auto known = known_.find(place);
        if (known != known_.end()) return known->second;
        return known_[place] = error_(setting_of(place));
    }
    /// One value on or back; false at the end of the axis.
    [[nodiscard]] bool move(Place& place, std::size_t axis, int by) const
    {
        if (by < 0 ? place[axis] == 0 : place[axis] + 1 == axes_[axis].values.size()) return false;
        place[axis] += by < 0 ? std::size_t(-1) : 1;
        return true;
    }
    void look(const Place& place)
    {
        const double error = error_at(place);
        if (!(error < least_)) return;
        least_ = error;
        best_ = place;
    }
    void step()
    {
        if (!best_.empty()) at_ = std::exchange(best_, {});
    }

    const std::vector<Axis>& axes_;
    const std::function<double(const Setting&)>& error_;
    std::map<Place, double> known_;
    std::vector<std::size_t> free_;
    Place at_, best_;
    double least_ = 0;
};

}  // namespace

std::vector<Setting> starts(const std::vector<Axis>& axes, bool costly)
{
    std::vector<Setting> settings{{}};
    for (const Axis& axis : axes) {
        const bool all =
            axis.kind == AxisKind::quality || (costly && axis.kind == AxisKind::costly);
        std::vector<Setting> longer;
        for (const Setting& setting : settings)
            for (const double value : all ? axis.values : std::vector<double>{axis.standard}) {
                longer.push_back(setting);
                longer.back().push_back(value);
            }
        settings = std::move(longer);
    }
    return settings;
}

Candidate tune(const std::vector<Axis>& axes, const Setting& start,
               const std::function<double(const Setting&)>& error)
{
    Walk walk{axes, start, error};
    for (int round = 0; round < most_rounds; ++round) {
        const double before = walk.least();
        walk.along_each_axis();
        walk.across_pairs();
        if (!(walk.least() < before * worthwhile)) break;
    }
    return {walk.setting(), walk.least()};
}

std::vector<Candidate> worth_timing(std::vector<Candidate> candidates, double margin)
{
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
        return std::tie(a.time, a.error, a.setting) < std::tie(b.time, b.error, b.setting);
    });
    std::vector<Candidate> kept;
    for (const Candidate& candidate : candidates) {
        const bool beaten = std::any_of(kept.begin(), kept.end(), [&](const Candidate& other) {
            return other.setting == candidate.setting ||
                   (other.error <= candidate.error && other.time < margin * candidate.time);
        });
        if (!beaten) kept.push_back(candidate);
    }
    return kept;
}

std::optional<std::size_t> best_within(std::span<const Candidate> candidates, double budget)
{
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        const Candidate& candidate = candidates[i];
        if (!(candidate.time <= budget)) continue;
        if (!best || std::tie(candidate.error, candidate.time) <
                         std::tie(candidates[*best].error, candidates[*best].time))
            best = i;
    }
    return best;
}

std::vector<Choice> choices(const std::vector<Candidate>& tuned,
                            const std::vector<Candidate>& standard, std::span<const double> budgets,
                            const std::function<double(const Setting&)>& held_out_error)
{
    std::vector<Candidate> all = tuned;
    all.insert(all.end(), standard.begin(), standard.end());
    std::map<Setting, double> known;
    const auto judged = [&](const Setting& setting) {
        const auto found = known.find(setting);
        return found != known.end() ? found->second : known[setting] = held_out_error(setting);
    };
    std::vector<Choice> chosen;
    for (const double budget : budgets) {
        const auto best = best_within(all, budget), usual = best_within(standard, budget);
        if (!best || !usual) continue;
        Choice choice{budget, all[*best], standard[*usual]};
        choice.held_out_error = judged(choice.tuned.setting);
        choice.standard_held_out_error = judged(choice.standard.setting);
        chosen.push_back(std::move(choice));
    }
    return chosen;
}

}  // namespace report
