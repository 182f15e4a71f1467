#include "parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "common.hpp"

namespace compare {

namespace {

/// A number in [0, 1) for a place.
double scattered(int x, int y)
{
    std::uint32_t bits =
        static_cast<std::uint32_t>(x) * 0x9e3779b1u + static_cast<std::uint32_t>(y) * 0x85ebca77u;
    bits = (bits ^ bits >> 16) * 0x85ebca6bu;
    bits = (bits ^ bits >> 13) * 0xc2b2ae35u;
    return (bits ^ bits >> 16) * 0x1p-32;
}

/// The blobs of a map have about that part of the picture's height.
constexpr int blobs = 8;

/// Smooth noise over cells of unit size.
double clustered(double x, double y)
{
    const int left = static_cast<int>(x), top = static_cast<int>(y);
    const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
    const double u = smooth(x - left), v = smooth(y - top);
    const auto row = [&](int at) {
        return scattered(left, at) * (1 - u) + scattered(left + 1, at) * u;
    };
    return row(top) * (1 - v) + row(top + 1) * v;
}

/// The share of all groups, those of least noise.
nook::Image<std::uint8_t> make_groups(int width, int height, double share, bool in_clusters)
{
    const int columns = nook::WorkMap::groups(width);
    nook::Image<double> noise{columns, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < columns; ++x)
            noise(x, y) = in_clusters ? clustered((x + 0.5) * nook::WorkMap::group / height * blobs,
                                                  (y + 0.5) / height * blobs)
                                      : scattered(x, y);
    std::vector<double> sorted(noise.begin(), noise.end());
    const auto bound = sorted.begin() + static_cast<std::ptrdiff_t>(share * double(sorted.size()));
    std::nth_element(sorted.begin(), bound, sorted.end());
    nook::Image<std::uint8_t> groups{columns, height};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < columns; ++x) groups(x, y) = noise(x, y) < *bound ? 1 : 0;
    return groups;
}

/// What runs under a map.
struct Kernel {
    std::string name;
    int samples;
    std::function<nook::Outcome(const Job& job)> run;
};

struct MaskMarks {
    Mark tenth{"share of the ideal saving, 10 % of the pixels active, clustered", true, 0.8, 0.9};
    Mark third{"share of the ideal saving, 30 % of the pixels active, clustered", true, 0.6, 0.75};
};

void compare_picture(const Options& options, const Picture& picture, Results& results,
                     MaskMarks& marks)
{
    const Kernels& best = targets().best();
    const auto obscurance = [&](int samples) -> Kernel {
        return {"AAO " + std::to_string(samples), samples,
                [=, &picture, run = best.alchemy_ao](const Job& job) {
                    return run(job, alchemy(picture, samples));
                }};
    };
    const Kernel kernels[] = {
        obscurance(8), obscurance(16), {"GTAO 3 x 6", 18, [&](const Job& job) {
                                            return best.horizon_ao(job, {.radius = picture.radius});
                                        }}};
    struct Map {
        double share;
        bool in_clusters;
        nook::Image<std::uint8_t> groups;
    };
    std::vector<Map> maps;
    for (const bool in_clusters : {true, false})
        for (const double share : {0.1, 0.3, 0.6})
            maps.push_back({share, in_clusters,
                            make_groups(picture.width(), picture.height(), share, in_clusters)});

    const nook::Image<std::uint8_t> none{nook::WorkMap::groups(picture.width()), picture.height()};

    std::vector<std::vector<std::string>> rows{{"share of the ideal saving", "10 %, clustered",
                                                "30 %", "60 %", "10 %, scattered", "30 %", "60 %",
                                                "all active, ns/px", "none"}};
    for (const Kernel& kernel : kernels) {
        nook::Image<float> out{picture.width(), picture.height()};
        Job job = picture.job();
        job.visibility = out.view();
        std::vector<Contender> contenders{nook_contender(kernel.name, job, kernel.run)};
        std::vector<double> active{1};
        for (const Map& map : maps) {
            job.work_map = {map.groups.view(), false};
            contenders.push_back(nook_contender(
                kernel.name + (map.in_clusters ? ", clustered" : ", scattered"), job, kernel.run));
            // Only surfaces cost anything.
            Workspace workspace;
            job.workspace = &workspace;
            const nook::Work work = checked(kernel.run(job), "a masked kernel");
            Job whole = job;
            whole.work_map = {};
            const nook::Work all = checked(kernel.run(whole), "a kernel");
            active.push_back(1 - double(work.skipped) / double(all.pixels - all.background));
        }
        job.work_map = {none.view(), false};
        contenders.push_back(nook_contender(kernel.name + ", none active", job, kernel.run));
        active.push_back(0);
        const Times times{contenders, effort(options)};
        std::vector<std::string> row{kernel.name};
        for (std::size_t i = 0; i < contenders.size(); ++i) {
            Measurement m = measured("mask", picture, contenders, times, i, 0);
            m.samples = kernel.samples;
            m.active = active[i];
            results.measurements.push_back(m);
            if (i == 0 || i > maps.size()) continue;
            const double ideal = 1 - active[i];
            const Summary share{(1 - m.ratio.median) / ideal, (1 - m.ratio.upper) / ideal,
                                (1 - m.ratio.lower) / ideal};
            row.push_back(text_of(share));
            const Map& map = maps[i - 1];
            if (!map.in_clusters || map.share > 0.5) continue;
            (map.share < 0.2 ? marks.tenth : marks.third)
                .take(share, picture.name + ", " + kernel.name);
        }
        for (const std::size_t i : {std::size_t{0}, contenders.size() - 1})
            row.push_back(digits("%.2f", per_pixel(times.seconds(i), picture.pixels()).median));
        rows.push_back(row);
    }
    std::printf("%s: work maps, nook %s\n", picture.name.c_str(), best.name);
    print_table(rows);
}

}  // namespace

void compare_masks(const Options& options, const std::vector<Picture>& pictures, Results& results)
{
    MaskMarks marks;
    for (const Picture& picture : pictures) compare_picture(options, picture, results, marks);
    std::printf(
        "The ideal saving is the share of the surface pixels that the map spares. Maps have whole\n"
        "groups of %d x 1 pixels: blobs of about 1/%d of the picture's height, or single ones.\n"
        "What is needed of neighbours comes less often from the caches where blobs are small.\n\n",
        nook::WorkMap::group, blobs);
    results.marks.push_back(marks.tenth);
    results.marks.push_back(marks.third);
}

}  // namespace compare
