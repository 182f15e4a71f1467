#include "rotation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

namespace compare {

namespace {

double now(Clock clock)
{
    if (clock == Clock::processor) return double(std::clock()) / CLOCKS_PER_SEC;
    const std::chrono::duration<double> passed =
        std::chrono::steady_clock::now().time_since_epoch();
    return passed.count();
}

double timed(const Contender& contender, int calls, Clock clock)
{
    const double start = now(clock);
    for (int call = 0; call < calls; ++call) contender.run();
    // No clock is so coarse that a turn took no time at all.
    return (std::max)(now(clock) - start, 1e-9) / calls;
}

}  // namespace

Summary summary_of(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    const auto quantile = [&](double share) {
        const double at = share * double(values.size() - 1);
        const auto below = static_cast<std::size_t>(at);
        const std::size_t above = (std::min)(below + 1, values.size() - 1);
        return values[below] + (at - double(below)) * (values[above] - values[below]);
    };
    return {quantile(0.5), quantile(0.25), quantile(0.75)};
}

Times::Times(const std::vector<Contender>& contenders, const Effort& effort)
    : seconds_(contenders.size())
{
    std::vector<int> calls;
    for (const Contender& contender : contenders) {
        contender.run();
        const double once = (std::max)(timed(contender, 1, effort.clock), 1e-6);
        calls.push_back(
            static_cast<int>(std::clamp(std::ceil(effort.turn_seconds / once), 1.0, 1e4)));
    }
    for (int round = 0; round < effort.rounds; ++round)
        for (std::size_t i = 0; i < contenders.size(); ++i) {
            if (effort.untimed_call) contenders[i].run();
            seconds_[i].push_back(timed(contenders[i], calls[i], effort.clock));
        }
}

Summary Times::seconds(std::size_t contender) const { return summary_of(seconds_[contender]); }

double Times::least_seconds(std::size_t contender) const
{
    return *std::min_element(seconds_[contender].begin(), seconds_[contender].end());
}

Summary Times::ratio(std::size_t one, std::size_t other) const
{
    std::vector<double> ratios;
    for (std::size_t round = 0; round < seconds_[one].size(); ++round)
        ratios.push_back(seconds_[one][round] / seconds_[other][round]);
    return summary_of(std::move(ratios));
}

}  // namespace compare
