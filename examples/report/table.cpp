#include <algorithm>
#include <cstdio>
#include <ostream>

#include "output.hpp"

namespace report {

namespace {

template <class... Values>
std::string line(const char* format, Values... values)
{
    char text[256];
    std::snprintf(text, sizeof text, format, values...);
    return text;
}

/// The median with that many threads; empty when it was not timed.
std::string milliseconds(const SceneReport::Row& row, int threads)
{
    for (const Timing& timing : row.timings)
        if (timing.threads == threads) return line("%.2f", timing.median);
    return "";
}

}  // namespace

void print_table(std::ostream& out, const std::vector<SceneReport>& scenes)
{
    for (const SceneReport& scene : scenes) {
        out << line("%s: %zu triangles", scene.name.c_str(), scene.triangles);
        if (scene.dropped > 0) out << line(" (%zu bad ones dropped)", scene.dropped);
        out << line(", %d x %d%s, %.1f %% background\n", scene.width, scene.height,
                    scene.orthographic ? " orthographic" : "", 100 * scene.background_share);
        out << line(
            "  reference: traced, %d rays per pixel, radius %.4g, %.2f s, standard error "
            "%.4f",
            scene.rays, scene.radius, scene.reference_seconds, scene.standard_error);
        if (scene.rays_skipped > 0)
            out << line(", %.0f %% of rays skipped",
                        100 * double(scene.rays_skipped) /
                            (double(scene.rays_skipped) + double(scene.rays_traced)));
        out << line(
            "\n  the depth buffer as the only geometry: %d slices, 1 row in %d, %.2f s, RMSE %.4f "
            "against the reference\n",
            scene.slices, scene.height_field_step, scene.height_field_seconds, scene.unknown.rmse);

        std::size_t briefs = 10;
        std::vector<int> threads;
        for (const SceneReport::Row& row : scene.rows) {
            briefs = (std::max)(briefs, row.brief.size());
            for (const Timing& timing : row.timings)
                if (std::find(threads.begin(), threads.end(), timing.threads) == threads.end())
                    threads.push_back(timing.threads);
        }
        out << line("  %-22s %-*s", "kernel", int(briefs), "parameters");
        for (const int count : threads)
            out << line(" %9s", ("ms, " + std::to_string(count) + " th").c_str());
        out << "    RMSE     MAE     bias     p99     max    SSIM   depth      own\n";
        for (const SceneReport::Row& row : scene.rows) {
            out << line("  %-22s %-*s", row.kernel.c_str(), int(briefs), row.brief.c_str());
            for (const int count : threads) out << line(" %9s", milliseconds(row, count).c_str());
            out << line(" %7.4f %7.4f %+8.4f %7.4f %7.4f %7.4f", row.error.rmse, row.error.mae,
                        row.error.bias, row.error.p99, row.error.maximum, row.ssim);
            out << line(" %7.4f", row.height_field.rmse);
            out << (row.exact ? line(" %8.1e\n", row.exact->rmse) : "\n");
        }
        out << line(
            "  the two range checks differ by RMS %.4f, p99 %.4f, at most %.4f, over %llu "
            "pixels\n\n",
            scene.range_checks.rmse, scene.range_checks.p99, scene.range_checks.maximum,
            static_cast<unsigned long long>(scene.range_checks.pixels));
    }
}

}  // namespace report
