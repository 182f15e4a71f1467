#include "table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <optional>

#include <nook/measure/error.hpp>
#include <nook/scene/bvh.hpp>
#include <nook/scene/outline_ao.hpp>
#include <nook/scene/outline_mask.hpp>
#include <nook/scene/traced_ao.hpp>
#include <nook/scene/vertex_values.hpp>
#include <nook/surface/alchemy_ao.hpp>
#include <nook/surface/height_field_ao.hpp>

#include "../support/checked.hpp"
#include "../support/picture.hpp"
#include "textbook_ao.hpp"
#include "timing.hpp"

namespace outlines {

namespace {

using support::checked;
using Bytes = nook::Image<std::uint8_t>;
using Visibility = nook::Image<float>;

/// A kernel that is run with and without a mask.
struct Kernel {
    std::string name;
    int samples;
    std::function<void(const Frame& frame, Visibility& out, const nook::WorkMap& map)> run;
};

std::vector<Kernel> kernels_of(const Subject& subject, const Protocol& protocol,
                               nook::HeapScratch& scratch)
{
    std::vector<Kernel> kernels;
    for (const int samples : protocol.samples) {
        nook::AlchemyOptions options;
        options.radius = subject.radius;
        options.samples = samples;
        kernels.push_back(
            {"textbook", samples,
             [options](const Frame& frame, Visibility& out, const nook::WorkMap& map) {
                 textbook_ao(frame.depth.view(), frame.normal(), out.view(), options,
                             frame.projection, map);
             }});
        kernels.push_back(
            {"nook", samples,
             [options, &scratch](const Frame& frame, Visibility& out, const nook::WorkMap& map) {
                 checked(nook::alchemy_ao(frame.depth.view(), frame.normal(), out.view(), options,
                                          frame.projection, map, scratch),
                         "alchemy_ao");
             }});
    }
    return kernels;
}

/// Sums over frames.
struct Sum {
    double total = 0, worst = 0;

    void add(double milliseconds)
    {
        total += milliseconds;
        worst = (std::max)(worst, milliseconds);
    }
    [[nodiscard]] Times over(int frames) const { return {total / frames, worst}; }
};

/// Surface pixels of every n-th row.
Bytes counted_rows(const Frame& frame, int step)
{
    Bytes counted{frame.width(), frame.height()};
    for (int y = 0; y < frame.height(); ++y)
        for (int x = 0; x < frame.width(); ++x)
            counted(x, y) = y % step == step / 2 && frame.faces(x, y) != nook::no_face ? 1 : 0;
    return counted;
}

double mean_square(const Visibility& one, const Visibility& other, const Bytes& counted)
{
    const nook::Measured result = nook::rmse(one.view(), other.view(), counted.view());
    if (!result) throw support::Failure{"rmse: " + support::text_of(result.error)};
    return result.value * result.value;
}

/// Both references over some rows of a frame.
struct References {
    Bytes counted;
    Visibility traced, height_field;

    References(const Subject& subject, const nook::Bvh& bvh, const Frame& frame,
               const Protocol& protocol, nook::ThreadExecutor& threads)
        : counted{counted_rows(frame, protocol.row_step)},
          traced{frame.width(), frame.height()},
          height_field{frame.width(), frame.height()}
    {
        Bytes rows{nook::WorkMap::groups(frame.width()), frame.height()};
        for (int y = 0; y < rows.height(); ++y)
            for (int x = 0; x < rows.width(); ++x)
                rows(x, y) = y % protocol.row_step == protocol.row_step / 2 ? 1 : 0;
        const nook::WorkMap map{rows.view(), false};
        checked(nook::traced_ao(
                    bvh, frame.depth.view(), frame.normal(), traced.view(),
                    nook::TracedOptions<>{.radius = subject.radius, .directions = protocol.rays},
                    frame.projection, frame.axes, map, nook::HeapScratch{}, threads),
                "traced_ao");
        checked(nook::height_field_ao(frame.depth.view(), frame.normal(), height_field.view(),
                                      {.radius = subject.radius, .slices = protocol.slices},
                                      frame.projection, map, nook::HeapScratch{}, threads),
                "height_field_ao");
    }
    void add(const Visibility& visibility, Errors& squares) const
    {
        squares.traced += mean_square(visibility, traced, counted);
        squares.height_field += mean_square(visibility, height_field, counted);
    }
};

Errors roots(const Errors& squares, int frames, int reference_frames)
{
    return {std::sqrt(squares.full / frames), std::sqrt(squares.traced / reference_frames),
            std::sqrt(squares.height_field / reference_frames)};
}

support::Picture grey(const Visibility& visibility)
{
    support::Picture picture{visibility.width(), visibility.height()};
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x)
            picture.set(x, y, support::Rgb{1, 1, 1} * visibility(x, y));
    return picture;
}

/// The mask in orange over the visibility.
support::Picture masked_picture(const Visibility& visibility, const Bytes& groups)
{
    support::Picture picture = grey(visibility);
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x)
            if (groups(x / nook::WorkMap::group, y) != 0)
                picture.set(x, y, picture.get(x, y) * support::Rgb{1.0f, 0.72f, 0.35f});
    return picture;
}

}  // namespace

Table measure(const Subject& subject, const std::string& shell_name,
              const nook::OutlineShell& shell, double extent, const Protocol& protocol,
              const std::filesystem::path& folder, const std::string& prefix,
              nook::ThreadExecutor& threads, const Baked* baked)
{
    Table table;
    table.scene = subject.scene.name;
    table.shell = shell_name;
    table.triangles = subject.scene.triangles();
    table.shell_triangles = shell.view().triangle_count;
    table.objects = shell.object_count();
    table.inward = shell.inward_count();
    table.radius = subject.radius;
    table.extent = extent;
    table.needed_extent = shell.needed_extent(subject.radius);
    table.threshold = 2 - static_cast<int>(table.inward);

    nook::Bvh bvh;
    checked(bvh.build(subject.scene.mesh()), "Bvh::build");
    nook::HeapScratch scratch, kernel_scratch;
    const std::vector<Kernel> kernels = kernels_of(subject, protocol, kernel_scratch);
    const int width = protocol.width, height = protocol.height;
    Bytes groups{nook::WorkMap::groups(width), height};
    Visibility full{width, height}, masked{width, height}, alone{width, height};
    Sum mask_sum, alone_sum;
    std::vector<Sum> full_sums(kernels.size()), masked_sums(kernels.size());
    Errors alone_squares;
    std::vector<Errors> full_squares(kernels.size()), squares(kernels.size());
    table.rows.resize(kernels.size());

    for (int i = 0; i < protocol.frames; ++i) {
        const Frame frame{subject.scene, subject.camera(2 * std::numbers::pi * i / protocol.frames),
                          width, height, threads};
        if (frame.surfaces == 0) continue;
        const bool compared = i < protocol.reference_frames;
        nook::Work work;
        const auto mask = [&] {
            work = checked(nook::outline_mask(shell.view(), extent, frame.depth.view(),
                                              groups.view(), {.threshold = table.threshold},
                                              frame.axes, frame.projection, scratch),
                           "outline_mask");
        };
        const auto stand_alone = [&] {
            checked(nook::outline_ao(shell.view(), extent, frame.depth.view(), alone.view(),
                                     {.threshold = table.threshold}, frame.axes, frame.projection,
                                     scratch),
                    "outline_ao");
        };
        const auto run_masked = [&](const Kernel& kernel, const nook::WorkMap& map) {
            kernel.run(frame, masked, map);
            if (baked == nullptr) return;
            const nook::MeshView mesh{baked->positions.data(), baked->positions.size() / 3,
                                      baked->indices.data(), baked->indices.size() / 3};
            checked(
                nook::vertex_values(mesh, frame.faces.view(), baked->values.data(), masked.view(),
                                    {.multiply = true}, frame.projection, frame.axes, {}, scratch),
                "vertex_values");
        };
        mask();
        const nook::WorkMap map = nook::outline_work_map(groups.view());
        const double surfaces = double(frame.surfaces);
        table.stencil += double(work.samples) / surfaces / protocol.frames;
        table.computed += (surfaces - double(work.skipped)) / surfaces / protocol.frames;

        double mask_times[3], alone_times[3];
        struct Turns {
            double times[3];
        };
        std::vector<Turns> full_times(kernels.size()), masked_times(kernels.size());
        for (int turn = 0; turn < 3; ++turn) {
            mask_times[turn] = milliseconds(mask);
            alone_times[turn] = milliseconds(stand_alone);
            for (std::size_t k = 0; k < kernels.size(); ++k) {
                full_times[k].times[turn] = milliseconds([&] { kernels[k].run(frame, full, {}); });
                masked_times[k].times[turn] = milliseconds([&] { run_masked(kernels[k], map); });
            }
        }
        const double mask_time = median(mask_times);
        mask_sum.add(mask_time);
        alone_sum.add(median(alone_times));
        for (std::size_t k = 0; k < kernels.size(); ++k) {
            full_sums[k].add(median(full_times[k].times));
            masked_sums[k].add(mask_time + median(masked_times[k].times));
        }

        const Bytes surface = counted_rows(frame, 1);
        std::optional<References> references;
        if (compared) references.emplace(subject, bvh, frame, protocol, threads);
        for (std::size_t k = 0; k < kernels.size(); ++k) {
            kernels[k].run(frame, full, {});
            run_masked(kernels[k], map);
            squares[k].full += mean_square(masked, full, surface);
            if (!compared) continue;
            references->add(full, full_squares[k]);
            references->add(masked, squares[k]);
            if (i == 0 && k + 1 == kernels.size()) {
                support::write_png(folder / (prefix + "-full.png"), grey(full));
                support::write_png(folder / (prefix + "-masked.png"),
                                   masked_picture(masked, groups));
                support::write_png(folder / (prefix + "-alone.png"), grey(alone));
            }
        }
        if (compared) references->add(alone, alone_squares);
    }
    table.mask = mask_sum.over(protocol.frames);
    table.alone = alone_sum.over(protocol.frames);
    const int compared = (std::min)(protocol.frames, protocol.reference_frames);
    table.alone_errors = roots(alone_squares, protocol.frames, compared);
    for (std::size_t k = 0; k < kernels.size(); ++k)
        table.rows[k] = {kernels[k].name,
                         kernels[k].samples,
                         full_sums[k].over(protocol.frames),
                         masked_sums[k].over(protocol.frames),
                         roots(full_squares[k], protocol.frames, compared),
                         roots(squares[k], protocol.frames, compared)};
    return table;
}

void print(const Table& table)
{
    std::printf("%s, %s: %zu triangles, %zu with the shells of %zu objects (%zu inside out)\n",
                table.scene.c_str(), table.shell.c_str(), table.triangles,
                table.triangles + table.shell_triangles, table.objects, table.inward);
    std::printf(
        "  radius %.4g, extent %.4g (%.4g needed), %.1f %% of the surface pixels in two shells, "
        "%.1f %% computed\n",
        table.radius, table.extent, table.needed_extent, 100 * table.stencil, 100 * table.computed);
    std::printf("  %-14s %8s %8s %8s %8s %9s %9s %9s %9s %9s %9s\n", "kernel", "full ms", "worst",
                "masked", "worst", "less time", "to full", "full:ray", "masked:ray", "full:buf",
                "masked:buf");
    for (const Row& row : table.rows)
        std::printf("  %-9s %4d %8.2f %8.2f %8.2f %8.2f %8.1f%% %9.4f %9.4f %10.4f %9.4f %10.4f\n",
                    row.kernel.c_str(), row.samples, row.full.average, row.full.worst,
                    row.masked.average, row.masked.worst,
                    100 * (1 - row.masked.average / row.full.average), row.errors.full,
                    row.full_errors.traced, row.errors.traced, row.full_errors.height_field,
                    row.errors.height_field);
    std::printf("  %-14s %8.2f %8.2f\n", "mask alone", table.mask.average, table.mask.worst);
    std::printf("  %-14s %8.2f %8.2f %47s %9.4f %10s %9.4f\n\n", "stand-alone", table.alone.average,
                table.alone.worst, "", table.alone_errors.traced, "",
                table.alone_errors.height_field);
    std::fflush(stdout);
}

nlohmann::ordered_json json_of(const Table& table)
{
    using Json = nlohmann::ordered_json;
    const auto times = [](const Times& t) {
        return Json{{"average", t.average}, {"worst", t.worst}};
    };
    const auto errors = [](const Errors& e) {
        return Json{
            {"to_full", e.full}, {"to_traced", e.traced}, {"to_height_field", e.height_field}};
    };
    Json json{{"scene", table.scene},
              {"shell", table.shell},
              {"triangles", table.triangles},
              {"shell_triangles", table.shell_triangles},
              {"objects", table.objects},
              {"inward_objects", table.inward},
              {"radius", table.radius},
              {"extent", table.extent},
              {"threshold", table.threshold},
              {"stencil_share", table.stencil},
              {"computed_share", table.computed},
              {"mask_milliseconds", times(table.mask)},
              {"stand_alone",
               {{"milliseconds", times(table.alone)}, {"errors", errors(table.alone_errors)}}}};
    // JSON has no infinity.
    if (std::isfinite(table.needed_extent)) json["needed_extent"] = table.needed_extent;
    else json["needed_extent"] = nullptr;
    json["rows"] = Json::array();
    for (const Row& row : table.rows)
        json["rows"].push_back({{"kernel", row.kernel},
                                {"samples", row.samples},
                                {"full_milliseconds", times(row.full)},
                                {"masked_milliseconds", times(row.masked)},
                                {"full_errors", errors(row.full_errors)},
                                {"masked_errors", errors(row.errors)}});
    return json;
}

}  // namespace outlines
