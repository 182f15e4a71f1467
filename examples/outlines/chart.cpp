#include "chart.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include <nook/scene/outline_mask.hpp>
#include <nook/surface/alchemy_ao.hpp>

#include "../support/checked.hpp"
#include "../support/picture.hpp"
#include "../support/plot.hpp"
#include "textbook_ao.hpp"
#include "timing.hpp"

namespace outlines {

namespace {

using support::checked;

/// The first objects of a shell, with about that many triangles and the vertices they use. Whole
/// objects, since counting takes longer for open shells; a part of the first if that is too large.
nook::OutlineView first_objects(const nook::OutlineShell& shell, std::size_t count)
{
    nook::OutlineView view = shell.view();
    if (count < view.triangle_count) {
        const nook::OutlineObject& last = shell.object(shell.object_of(count));
        const std::size_t end = std::size_t{last.first_triangle} + last.triangle_count;
        view.triangle_count = end <= 2 * count ? end : count;
    }
    std::size_t vertices = 0;
    for (std::size_t i = 0; i < 3 * view.triangle_count; ++i)
        vertices = (std::max)(vertices, std::size_t{view.indices[i]} + 1);
    view.vertex_count = vertices;
    return view;
}

/// Blocks of 64 × 32 pixels of which about that share is active.
nook::Image<std::uint8_t> clustered(int width, int height, double share)
{
    nook::Image<std::uint8_t> groups{nook::WorkMap::groups(width), height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < groups.width(); ++x) {
            const auto block = static_cast<std::uint32_t>(y / 32 * 1024 + x / 4);
            const std::uint32_t hash = (block ^ block >> 7) * 2654435769u;
            groups(x, y) = (hash >> 8) * 0x1p-24 < share ? 1 : 0;
        }
    return groups;
}

/// The time of a kernel: `full` without a map, and a straight line over the active share with one.
struct Cost {
    double full = 0, none = 0, per_share = 0;

    /// The share at which mask and masked kernel take as long as the kernel alone.
    [[nodiscard]] double break_even(double mask) const
    {
        return std::clamp((full - mask - none) / per_share, 0.0, 1.0);
    }
};

using Run = std::function<void(int samples, const nook::WorkMap& map)>;

Cost cost_of(const Run& run, int samples, int width, int height)
{
    double full[3], none[3], part[3];
    constexpr double share = 0.3;
    const nook::Image<std::uint8_t> nothing = clustered(width, height, 0),
                                    some = clustered(width, height, share);
    double active = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < some.width(); ++x) active += some(x, y);
    active /= double(some.width()) * height;
    for (int turn = 0; turn < 3; ++turn) {
        full[turn] = milliseconds([&] { run(samples, {}); });
        none[turn] = milliseconds([&] { run(samples, {nothing.view(), false}); });
        part[turn] = milliseconds([&] { run(samples, {some.view(), false}); });
    }
    Cost cost{median(full), median(none), 0};
    cost.per_share = (std::max)((median(part) - cost.none) / active, 1e-9);
    return cost;
}

}  // namespace

nlohmann::ordered_json break_even(const Subject& subject, const nook::OutlineShell& shell,
                                  double extent, const Protocol& protocol,
                                  const std::filesystem::path& folder,
                                  nook::ThreadExecutor& threads)
{
    using Json = nlohmann::ordered_json;
    const Frame frame{subject.scene, subject.camera(0), protocol.width, protocol.height, threads};
    const int width = frame.width(), height = frame.height();
    nook::HeapScratch scratch;
    nook::Image<float> visibility{width, height};
    nook::Image<std::uint8_t> groups{nook::WorkMap::groups(width), height};

    std::vector<double> counts, mask_times;
    const double most = double(shell.view().triangle_count);
    for (double count = 1000; count < 2 * most; count *= 2) {
        const nook::OutlineView part =
            first_objects(shell, static_cast<std::size_t>((std::min)(count, most)));
        double times[3];
        for (double& time : times)
            time = milliseconds([&] {
                checked(nook::outline_mask(part, extent, frame.depth.view(), groups.view(), {},
                                           frame.axes, frame.projection, scratch),
                        "outline_mask");
            });
        if (!counts.empty() && double(part.triangle_count) <= counts.back()) continue;
        counts.push_back(double(part.triangle_count));
        mask_times.push_back(median(times));
    }

    nook::AlchemyOptions options;
    options.radius = subject.radius;
    const Run runs[] = {
        [&](int samples, const nook::WorkMap& map) {
            options.samples = samples;
            textbook_ao(frame.depth.view(), frame.normal(), visibility.view(), options,
                        frame.projection, map);
        },
        [&](int samples, const nook::WorkMap& map) {
            options.samples = samples;
            checked(nook::alchemy_ao(frame.depth.view(), frame.normal(), visibility.view(), options,
                                     frame.projection, map, scratch),
                    "alchemy_ao");
        }};
    const char* const names[] = {"plain loop", "nook"};
    constexpr int samples[] = {4, 8, 16, 32, 64};
    const support::Rgb colours[] = {support::plot_colours::black, support::plot_colours::blue,
                                    support::plot_colours::green, support::plot_colours::orange,
                                    support::plot_colours::vermilion};

    std::printf(
        "break-even: the active share, in %%, from which on the mask costs more than it saves "
        "(%s, %d x %d)\n  %-10s %8s",
        subject.scene.name.c_str(), width, height, "triangles", "mask ms");
    std::vector<support::Plot> plots;
    Json kernels = Json::array();
    for (int k = 0; k < 2; ++k) {
        support::Plot plot{std::string{names[k]} + ": break-even active share, %",
                           "triangles of the shells",
                           {},
                           {std::log10(counts.front()), std::log10(counts.back())},
                           {0, 100}};
        plot.x_label = support::power_label;
        plot.legend = k == 0 ? support::Corner::lower_left : support::Corner::upper_right;
        for (int s = 0; s < 5; ++s) {
            const Cost cost = cost_of(runs[k], samples[s], width, height);
            support::Series series{{}, {}, colours[s], std::to_string(samples[s]) + " samples"};
            Json shares = Json::array();
            for (std::size_t i = 0; i < counts.size(); ++i) {
                const double share = cost.break_even(mask_times[i]);
                series.x.push_back(std::log10(counts[i]));
                series.y.push_back(100 * share);
                shares.push_back(share);
            }
            plot.series.push_back(std::move(series));
            kernels.push_back({{"kernel", names[k]},
                               {"samples", samples[s]},
                               {"full_milliseconds", cost.full},
                               {"nothing_active_milliseconds", cost.none},
                               {"per_share_milliseconds", cost.per_share},
                               {"break_even", shares}});
            std::printf(" %7s%3d", k == 0 ? "plain" : "nook", samples[s]);
        }
        plots.push_back(std::move(plot));
    }
    std::printf("\n");
    for (std::size_t i = 0; i < counts.size(); ++i) {
        std::printf("  %-10.0f %8.2f", counts[i], mask_times[i]);
        for (const support::Plot& plot : plots)
            for (const support::Series& series : plot.series) std::printf(" %10.0f", series.y[i]);
        std::printf("\n");
    }
    std::printf("\n");
    support::write_png(folder / "break-even.png", support::draw_plots(plots));
    return {{"triangles", counts}, {"mask_milliseconds", mask_times}, {"kernels", kernels}};
}

}  // namespace outlines
