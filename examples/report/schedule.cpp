#include "schedule.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "../support/progress.hpp"
#include "reference.hpp"
#include "view.hpp"

namespace report {

double Schedule::seconds_of(const Cell& cell, Structures& structures, nook::ThreadExecutor& threads)
{
    // A small picture with few directions, and at the usual radius, stands for all cells of the scene.
    constexpr int smaller = 8, fewer = 32;
    Options small = options_;
    small.width = std::max(options_.width / smaller, 1);
    small.height = std::max(options_.height / smaller, 1);
    const View view = draw(cell.subject->scene, small, threads);
    const Setup setup{cell, view, structures, options_.quick, threads};
    if (subject_ != cell.subject) {
        subject_ = cell.subject;
        support::Progress silent;
        const Traced traced =
            trace(setup, Meaning::visibility, 2 * std::max(options_.directions / fewer, 1), silent);
        ray_ = traced.seconds / (double(small.width) * small.height * traced.directions);
    }
    const auto weight = [](Meaning meaning) {
        const bool secondary =
            meaning == Meaning::visibility_secondary || meaning == Meaning::obscurance_secondary;
        return secondary ? 3.0 : 1.0;
    };
    double references = 0, kernels = 0;
    for (const Meaning meaning : meanings_of(setup))
        references += weight(meaning) * options_.directions;
    std::vector<Kernel> traced;
    add_traced_kernels(setup, traced);
    for (const Kernel& kernel : traced)
        kernels += weight(kernel.meaning) * double{kernel.parameters.at("directions")};
    const double pixels = double(options_.width) * options_.height;
    const double rays = pixels * ray_ * (references + kernels * (1 + threads.concurrency()));
    // Of the other kernels, with their exact forms, errors and pictures.
    const double rest = options_.quick ? 1.7 : 14;
    return rays + rest * std::min(1.0, pixels / 5e4);
}

void Schedule::done(double expected, double seconds)
{
    left_ -= expected;
    expected_ += expected;
    taken_ += seconds;
}

double Schedule::left() const
{
    return std::max(left_, 0.0) * (expected_ > 0 ? taken_ / expected_ : 1);
}

std::string duration(double seconds)
{
    const auto whole = [](double value) { return std::to_string(std::lround(value)); };
    if (seconds < 90) return whole(std::max(seconds, 1.0)) + " s";
    if (seconds < 90 * 60) return whole(seconds / 60) + " min";
    const double hours = std::floor(seconds / 3600);
    return whole(hours) + " h " + whole((seconds - 3600 * hours) / 60) + " min";
}

}  // namespace report
