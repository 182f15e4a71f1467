#include "parts.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>

#include <nook/scene/outline.hpp>
#include <nook/surface/half_resolution.hpp>

#include "common.hpp"

namespace compare {

namespace {

/// Kernels above that gain by a factor; others come close to a pass that writes ones.
constexpr double costly = 5;
/// What a tolerant plan may add.
constexpr double largest_rms = 0.002;

std::vector<std::string> subjects(const Options& options, std::vector<std::string> usual)
{
    return options.subjects.empty() ? usual : options.subjects;
}

/// How much slower, in percent; at least a tenth, since a goal is a ratio.
Summary slower(const Summary& speed_up)
{
    const auto percent = [](double ratio) { return (std::max)(100 * (1 / ratio - 1), 0.1); };
    return {percent(speed_up.median), percent(speed_up.upper), percent(speed_up.lower)};
}

std::string place_of(const Measurement& m)
{
    return m.scene + ", " + m.kernel + (m.radius.empty() ? "" : ", R " + m.radius);
}

/// The fastest that changes no more than may be.
const PlannedTime* best_plan(const Measurement& m)
{
    const PlannedTime* result = nullptr;
    for (const PlannedTime& plan : m.plans)
        if (plan.change.rms <= largest_rms &&
            (result == nullptr || plan.speed_up.median > result->speed_up.median))
            result = &plan;
    return result;
}

struct Radius {
    const char* name;
    double of_diagonal;  ///< 0: the scene's own
};

/// Ray-traced visibility of every second pixel of every second row.
nook::Image<float> traced_picture(const Options& options, const View& view, const Hierarchy& bvh,
                                  double radius)
{
    nook::Image<float> result{(view.width() + 1) / 2, (view.height() + 1) / 2};
    Workspace workspace;
    Job job = view.job();
    job.depth = nook::half_view(job.depth);
    job.normals = nook::half_view(job.normals);
    job.projection = nook::half_projection(job.projection);
    job.visibility = result.view();
    job.workspace = &workspace;
    (void)checked(chosen(options).traced_ao(bvh.get(), job, {radius, 64}), "traced_ao");
    return result;
}

/// The kernel over triangles, and its planner if there is one.
Planned traced_kernel(const Options& options, const Hierarchy& bvh, const Rays& rays)
{
    const Kernels& best = chosen(options);
    Planned result{.name = "traced " + std::to_string(rays.directions),
                   .samples = rays.directions,
                   .run = [&best, &bvh, rays](const Job& job) {
                       return best.traced_ao(bvh.get(), job, rays);
                   }};
    if (best.plan_traced != nullptr)
        result.plan = [&best, &bvh, rays](const Job& job, const Groups& groups, double) {
            return best.plan_traced(bvh.get(), job, groups, rays);
        };
    return result;
}

}  // namespace

void compare_open(const Options& options, Results& results)
{
    Mark gain{"floor and empty view, kernels above 5 ns per pixel: speed-up", true, 10, 30};
    Mark close{"floor and empty view, other kernels: time over a pass that writes ones", false, 3,
               2};
    Mark rays{"floor and empty view, 16 rays: ns per pixel", false};
    for (const std::string& name : subjects(options, {"floor", "empty"})) {
        const View view{name, options};
        View rough = view;
        rough.roughen();
        const double radius = view.scene.radius;
        const Hierarchy bvh{options, view};
        const Kernels& best = chosen(options);
        std::vector<Planned> kernels = depth_kernels(options, rough, radius);
        for (Planned& kernel : surface_kernels(options, radius))
            kernels.push_back(std::move(kernel));

        // After kernels that left all of it out; in full after noise.
        const int half_width = (view.width() + 1) / 2, half_height = (view.height() + 1) / 2;
        const nook::Image<float> ones{view.width(), view.height(), 1};
        const nook::Image<float> half_ones{half_width, half_height, 1};
        nook::Image<float> noise = ones, half_noise = half_ones;
        for (nook::Image<float>* const image : {&noise, &half_noise})
            for (int y = 0; y < image->height(); ++y)
                for (int x = 0; x < image->width(); ++x)
                    (*image)(x, y) = static_cast<float>((x * 7 + y * 13) % 17) / 17;
        const auto in_full = [&rough](Job job) {
            job.depth = rough.depth.view();
            job.normals = rough.normal();
            return job;
        };
        kernels.push_back({.name = "blur, radius 4",
                           .run =
                               [&](const Job& job) {
                                   return best.bilateral_blur(job, ones.view(), {.radius = 4});
                               },
                           .full =
                               [&](const Job& job) {
                                   return best.bilateral_blur(in_full(job), noise.view(),
                                                              {.radius = 4});
                               }});
        kernels.push_back(
            {.name = "upsample",
             .run = [&](const Job& job) { return best.upsample(job, half_ones.view(), {}); },
             .full =
                 [&](const Job& job) {
                     return best.upsample(in_full(job), half_noise.view(), {});
                 }});
        kernels.push_back(traced_kernel(options, bvh, {radius, 16}));

        const std::size_t first = results.measurements.size();
        for (const Planned& kernel : kernels) {
            const Measurement& m = measure(options, view, kernel, {.part = "open"}, results);
            if (kernel.name.starts_with("traced")) {
                // It skips by itself, and what it would cost otherwise is not known here.
                rays.take(m.without, place_of(m));
                continue;
            }
            const PlannedTime* const plan = best_plan(m);
            const bool planned = plan != nullptr && plan->with.median < m.without.median;
            const double base = (std::max)(m.full.median, m.without.median);
            if (base >= costly) {
                // In full where that is known.
                if (m.full.median > 0) gain.take(m.full_speed_up, place_of(m));
                else if (planned) gain.take(plan->speed_up, place_of(m));
                else gain.take({1, 1, 1}, place_of(m));
            } else {
                close.take(planned ? plan->over_ones : m.over_ones, place_of(m));
            }
        }
        print_measurements(name + ": one thread, nook " + best.name, results, first);
    }
    results.marks.push_back(gain);
    results.marks.push_back(close);
    results.marks.push_back(rays);
}

void compare_scenes(const Options& options, Results& results)
{
    constexpr Radius radii[] = {{"own", 0}, {"1 %", 0.01}, {"5 %", 0.05}};
    std::vector<Mark> marks;
    for (const Radius& radius : radii)
        marks.push_back({"boxes, stairs, temple, city, AAO and GTAO at R " +
                             std::string{radius.name} + ": speed-up, change <= 0.002",
                         true, 1.4, 2.5});
    double reused = 0, count = 0;
    const std::size_t first = results.measurements.size();
    for (const std::string& name : subjects(options, {"boxes", "stairs", "temple", "city"})) {
        const View view{name, options};
        const Hierarchy bvh{options, view};
        for (std::size_t i = 0; i < std::size(radii); ++i) {
            const double of_diagonal = radii[i].of_diagonal;
            const double radius = of_diagonal > 0 ? of_diagonal * view.diagonal : view.scene.radius;
            nook::Image<float> traced;
            if (!options.quick) traced = traced_picture(options, view, bvh, radius);
            for (const Planned& kernel : surface_kernels(options, radius)) {
                const Measurement& m = measure(options, view, kernel,
                                               {.part = "scenes",
                                                .radius = radii[i].name,
                                                .traced = options.quick ? nullptr : &traced},
                                               results);
                for (const PlannedTime& plan : m.plans) {
                    reused += plan.map_alone.median / plan.with.median;
                    ++count;
                }
                if (kernel.name.starts_with("bitmask")) continue;
                const PlannedTime* const plan = best_plan(m);
                marks[i].take(plan != nullptr ? plan->speed_up : Summary{1, 1, 1}, place_of(m));
            }
        }
    }
    print_measurements(
        "scenes where a part is left out: one thread, nook " + std::string{chosen(options).name},
        results, first);
    for (Mark& mark : marks) results.marks.push_back(mark);
    if (count > 0) {
        std::printf(
            "A second frame of the same view, under the plan of the first: %.3f of the "
            "time of one that is\nplanned anew, on average.\n\n",
            reused / count);
        results.facts.push_back(
            {"time under the plan of the last frame over planning anew", reused / count});
    }
}

void compare_whole(const Options& options, Results& results)
{
    Mark costs{"corridor, tree, kernels above 5 ns per pixel: slower by planning, %", false, 3, 1};
    const std::size_t first = results.measurements.size();
    for (const std::string& name : subjects(options, {"corridor", "tree"})) {
        const View view{name, options};
        View rough = view;
        rough.roughen();
        std::vector<Planned> kernels = surface_kernels(options, view.scene.radius);
        for (Planned& kernel : depth_kernels(options, rough, view.scene.radius)) {
            kernel.full = {};
            kernels.push_back(std::move(kernel));
        }
        for (const Planned& kernel : kernels) {
            const Measurement& m =
                measure(options, view, kernel, {.part = "whole", .radius = "own"}, results);
            if (m.plans.empty() || m.without.median < costly) continue;
            // The exact one, which nobody need be told of.
            costs.take(slower(m.plans.front().speed_up), place_of(m));
        }
    }
    print_measurements(
        "scenes where nothing is left out: one thread, nook " + std::string{chosen(options).name},
        results, first);
    results.marks.push_back(costs);
}

void compare_traced(const Options& options, Results& results)
{
    constexpr Radius radii[] = {{"1 %", 0.01}, {"5 %", 0.05}};
    // The kernel asks its tiles itself, so a plan pays where it serves more than one call.
    Mark gain{"boxes, stairs, temple, city, rays: speed-up under a plan at hand", true};
    const std::size_t first = results.measurements.size();
    for (const std::string& name : subjects(options, {"boxes", "stairs", "temple", "city"})) {
        const View view{name, options};
        const Hierarchy bvh{options, view};
        for (const Radius& radius : radii)
            for (const int directions : {16, 64}) {
                const Planned kernel =
                    traced_kernel(options, bvh, {radius.of_diagonal * view.diagonal, directions});
                // A turn takes seconds.
                const int rounds =
                    (std::max)(options.rounds / (directions > 16 ? 5 : 2), options.quick ? 1 : 3);
                const Measurement& m =
                    measure(options, view, kernel,
                            {.part = "traced", .radius = radius.name, .rounds = rounds}, results);
                if (!m.plans.empty()) gain.take(m.plans.front().reused, place_of(m));
            }
    }
    print_measurements("rays: one thread, nook " + std::string{chosen(options).name}, results,
                       first);
    results.marks.push_back(gain);
}

void compare_outlines(const Options& options, Results& results)
{
    Mark faster{"temple, city, corridor, AAO 16: time with a plan over that with the outline mask",
                false, 1, 0.8};
    Mark better{"temple, city, corridor, AAO 16: change by a plan over that by the mask", false, 1,
                0.1};
    std::vector<std::vector<std::string>> rows{
        {"AAO 16", "without, ns/px", "with the mask", "exact plan", "tolerant plan",
         "exact over mask", "tolerant over mask", "rms mask", "exact", "tolerant",
         "left out by the mask", "exact", "tolerant"}};
    for (const std::string& name : subjects(options, {"temple", "city", "corridor"})) {
        const View view{name, options};
        const double radius = view.scene.radius;
        const Kernels& best = chosen(options);
        nook::OutlineShell shell;
        (void)checked(shell.build(view.scene.mesh()), "OutlineShell::build");
        // Where no extent is enough the radius is what everyone takes.
        const double needed = shell.needed_extent(radius);
        const OutlineJob outlines{shell.view(), needed <= 4 * radius ? needed : radius,
                                  2 - static_cast<int>(shell.inward_count())};
        const nook::AlchemyOptions alchemy{.radius = radius, .samples = 16};

        Workspace workspace;
        Job plain = view.job();
        plain.workspace = &workspace;
        nook::Image<float> without{view.width(), view.height()};
        plain.visibility = without.view();
        struct Side {
            nook::Image<float> out;
            nook::Image<std::uint8_t> groups;
            double tolerance;
            Change change{};
            double left_out = 0;
        };
        std::vector<Side> sides;
        for (const double tolerance : {-1.0, 0.0, options.tolerance})
            sides.push_back({{view.width(), view.height()},
                             {nook::WorkMap::groups(view.width()), view.height()},
                             tolerance});
        const auto shade = [&](Side& side) {
            Job job = plain;
            job.visibility = side.out.view();
            if (side.tolerance < 0) {
                (void)checked(best.outline_mask(job, outlines, side.groups.view()), "outline_mask");
                job.work_map = nook::outline_work_map(side.groups.view());
            } else {
                (void)checked(best.plan_alchemy(job, side.groups.view(), alchemy, side.tolerance),
                              "plan_surface");
                job.work_map = best.surface_map(side.groups.view(), side.tolerance);
            }
            return checked(best.alchemy_ao(job, alchemy), "alchemy_ao");
        };
        (void)checked(best.alchemy_ao(plain, alchemy), "alchemy_ao");
        for (Side& side : sides) {
            const nook::Work work = shade(side);
            const auto surfaces = double(work.pixels - work.background);
            side.left_out = surfaces > 0 ? double(work.skipped) / surfaces : 0;
            side.change = change_of(view, without, side.out);
        }
        draw_plan(options, view, nook::outline_work_map(sides[0].groups.view()),
                  name + "-outline-mask");
        if (sides[1].change.bits > 0)
            results.broken.push_back(
                name + ", outlines, AAO 16: " + std::to_string(sides[1].change.bits) + " pixels");
        std::vector<Contender> contenders{
            {"without", [&] { (void)checked(best.alchemy_ao(plain, alchemy), "alchemy_ao"); }}};
        for (Side& side : sides) contenders.push_back({"with", [&] { (void)shade(side); }});
        const Times times{contenders,
                          {.rounds = options.rounds,
                           .turn_seconds = options.quick ? 1e-4 : 4e-3,
                           .untimed_call = false}};
        std::vector<std::string> row{name};
        for (std::size_t i = 0; i < contenders.size(); ++i)
            row.push_back(digits("%.2f", per_pixel(times.seconds(i), view.pixels()).median));
        row.push_back(text_of(times.ratio(2, 1)));
        row.push_back(text_of(times.ratio(3, 1)));
        for (const Side& side : sides) row.push_back(digits("%.5f", side.change.rms));
        for (const Side& side : sides) row.push_back(digits("%.1f %%", 100 * side.left_out));
        rows.push_back(row);

        Measurement m;
        m.part = "outlines";
        m.scene = name;
        m.kernel = "AAO 16";
        m.radius = "own";
        m.width = view.width();
        m.height = view.height();
        m.without = per_pixel(times.seconds(0), view.pixels());
        constexpr const char* names[] = {"outline", "exact", "tolerant"};
        for (std::size_t i = 0; i < sides.size(); ++i) {
            PlannedTime time;
            time.plan = names[i];
            time.tolerance = (std::max)(sides[i].tolerance, 0.0);
            time.with = per_pixel(times.seconds(i + 1), view.pixels());
            time.speed_up = times.ratio(0, i + 1);
            time.pixels_left_out = sides[i].left_out;
            time.change = sides[i].change;
            m.plans.push_back(time);
        }
        results.measurements.push_back(m);

        // The better of the two.
        const double mask_rms = sides[0].change.rms;
        const bool tolerant =
            sides[2].change.rms <= mask_rms && times.ratio(3, 1).median < times.ratio(2, 1).median;
        faster.take(times.ratio(tolerant ? 3 : 2, 1), name);
        const double change = sides[tolerant ? 2 : 1].change.rms;
        const double over = mask_rms > 0 ? change / mask_rms : change > 0 ? 2 : 0;
        better.take({(std::max)(over, 1e-3), (std::max)(over, 1e-3), (std::max)(over, 1e-3)}, name);
    }
    std::printf(
        "plans against the stencil of outlines: one thread, nook %s; plans and masks "
        "included\n",
        chosen(options).name);
    print_table(rows);
    results.marks.push_back(faster);
    results.marks.push_back(better);
}

}  // namespace compare
