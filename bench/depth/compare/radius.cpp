#include "parts.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <limits>

#include <nook/scene/camera.hpp>
#include <nook/scene/rasteriser.hpp>

#include "common.hpp"
#include "scenes/scenes.hpp"

namespace compare {

namespace {

struct View {
    nook::Image<float> depth;
    nook::Projection projection;
    double radius = 0;
};

[[nodiscard]] View draw(const std::string& name, const Size& size)
{
    for (const scenes::Entry& entry : scenes::all()) {
        if (name != entry.name) continue;
        const scenes::Scene scene = entry.make();
        View view;
        view.depth = {size.width, size.height};
        view.projection = nook::projection(scene.camera, size.width, size.height);
        view.radius = scene.radius;
        checked(nook::rasterise(scene.mesh(), nook::view_frame(scene.camera), view.projection,
                                {.depth = view.depth.view()}),
                "rasterise");
        return view;
    }
    throw Failure{"there is no scene called " + name};
}

/// What the windows of a view look like.
struct WindowSizes {
    double mean = 0;
    int least = 0, most = 0;
    double background = 0;  ///< share of pixels
};
[[nodiscard]] WindowSizes window_sizes(const View& view, double radius, int max_window)
{
    WindowSizes result{0, max_window, 1, 0};
    double count = 0;
    for (const float distance : view.depth) {
        if (!nook::is_surface(distance, (std::numeric_limits<float>::max)())) continue;
        const double pixels = nook::pixels_per_length(view.projection, radius, double{distance}).x;
        const int window = pixels < max_window / 2 ? 2 * static_cast<int>(pixels) + 1 : max_window;
        result.mean += window;
        result.least = (std::min)(result.least, window);
        result.most = (std::max)(result.most, window);
        ++count;
    }
    const double pixels = double(view.depth.width()) * view.depth.height();
    result.mean /= (std::max)(count, 1.0);
    result.background = 1 - count / pixels;
    return result;
}

/// The radius whose windows are that large on average.
[[nodiscard]] double radius_of_mean(const View& view, double mean, int max_window)
{
    double below = 0, above = view.radius;
    for (int step = 0; step < 24; ++step) {
        const double middle = (below + above) / 2;
        (window_sizes(view, middle, max_window).mean < mean ? below : above) = middle;
    }
    return above;
}

/// The scenes' own radii lead to the largest window nearly everywhere. This mean lets windows vary.
constexpr double medium_window = 31;

}  // namespace

void compare_radius(const Options& options, Results& results)
{
    const Kernels& best = targets().best();
    const Size size = sizes(options).front();
    Mark over_tables{"windows by radius, speed-up over a summed area table", true, 3.5, 6};
    Mark over_fixed[] = {
        {"windows by radius, boxes: time over the mean fixed window", false, 2.5, 1.7},
        {"windows by radius, terrain: time over the mean fixed window", false, 4, 2}};
    std::vector<std::vector<std::string>> rows{{"scene, radius", "windows", "background",
                                                "nook, ns/px", "table, ns/px", "table over nook",
                                                "nook over fixed", "samples/px"}};
    std::vector<std::vector<std::string>> gaps{
        {"scene, radius", "largest difference from the table", "pixels beyond 1e-3"}};
    const std::size_t entries =
        (static_cast<std::size_t>(size.width) + 1) * (static_cast<std::size_t>(size.height) + 1);
    std::vector<double> sums(entries), squares(entries);
    std::vector<std::int32_t> counts(entries);
    nook::Image<float> out{size.width, size.height};
    const Visibility visibility = out.view();

    const char* const names[] = {"boxes", "terrain"};
    for (std::size_t scene = 0; scene < 2; ++scene) {
        const View view = draw(names[scene], size);
        const Depth depth = view.depth.view();
        for (const bool medium : {false, true}) {
            nook::ChebyshevOptions by_radius;
            by_radius.radius =
                medium ? radius_of_mean(view, medium_window, by_radius.max_window) : view.radius;
            const WindowSizes sizes_here =
                window_sizes(view, by_radius.radius, by_radius.max_window);
            nook::ChebyshevOptions fixed;
            fixed.window = (std::max)(2 * static_cast<int>(sizes_here.mean / 2) + 1, 3);
            // Who knows that there is no background leaves the counts out.
            const SumTables tables{sums.data(), squares.data(),
                                   sizes_here.background > 0 ? counts.data() : nullptr};

            nook::Work work{};
            std::vector<char> scratch(
                best.chebyshev_ao_scratch_size(depth, by_radius, view.projection, 1));
            const std::vector<Contender> contenders{
                {"nook, radius",
                 [&] {
                     work = checked(best.chebyshev_ao(depth, visibility, by_radius, view.projection,
                                                      {scratch.data(), scratch.size()}, {}),
                                    "chebyshev_ao");
                 }},
                {"summed area table, radius",
                 [&] {
                     best.fill_tables(depth, tables);
                     best.shade_tables_radius(depth, tables, by_radius.radius, by_radius.max_window,
                                              view.projection, visibility);
                 }},
                nook_contender("nook, mean window", best, depth, visibility, fixed)};

            const std::string label =
                std::string{names[scene]} + ", " + digits("%.3g", by_radius.radius);
            contenders[1].run();
            const nook::Image<float> expected = out;
            contenders[0].run();
            Agreement agreement = difference(out, expected);
            agreement.image = label;
            agreement.contender = contenders[1].name;
            agreement.width = size.width;
            agreement.height = size.height;
            results.agreements.push_back(agreement);
            gaps.push_back({label, digits("%.1e", agreement.largest),
                            digits("%.4f %%", 100 * agreement.share)});

            const Times times{contenders, effort(options)};
            for (std::size_t i = 0; i < contenders.size(); ++i)
                results.measurements.push_back(
                    {.part = "radius",
                     .image = label,
                     .contender = contenders[i].name,
                     .width = size.width,
                     .height = size.height,
                     .window = i == 2 ? fixed.window : 0,
                     .nanoseconds = per_pixel(times.seconds(i), size.pixels()),
                     .base = contenders[0].name,
                     .ratio = times.ratio(i, 0)});
            const double samples = double(work.samples) / double(size.pixels());
            results.facts.push_back({"samples read directly per pixel, " + label, samples});
            results.facts.push_back({"mean window, " + label, sizes_here.mean});
            const Summary gain = times.ratio(1, 0), cost = times.ratio(0, 2);
            rows.push_back({label,
                            std::to_string(sizes_here.least) + "..." +
                                std::to_string(sizes_here.most) + ", mean " +
                                digits("%.1f", sizes_here.mean),
                            digits("%.0f %%", 100 * sizes_here.background),
                            digits("%.3f", per_pixel(times.seconds(0), size.pixels()).median),
                            digits("%.3f", per_pixel(times.seconds(1), size.pixels()).median),
                            text_of(gain), text_of(cost), digits("%.3g", samples)});
            over_tables.take(gain, label);
            over_fixed[scene].take(cost, label + ", k = " + std::to_string(fixed.window));
        }
    }
    std::printf("%s: windows that follow the distance, nook %s\n", size.name, best.name);
    print_table(rows);
    std::printf(
        "The table sums about zero, so it is the one that errs where depth spans decades.\n");
    print_table(gaps);
    results.marks.insert(results.marks.end(), {over_tables, over_fixed[0], over_fixed[1]});
}

}  // namespace compare
