#include "common.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace compare {

namespace {

/// What a contender writes.
struct Buffers {
    nook::Image<float> out;
    nook::Image<std::uint8_t> groups;

    explicit Buffers(const View& view)
        : out{view.width(), view.height()},
          groups{nook::WorkMap::groups(view.width()), view.height()}
    {}
};

double share_of(double part, double all) { return all > 0 ? part / all : 0; }

/// RMSE against rays that were traced for every second pixel of every second row.
double traced_error(const View& view, const nook::Image<float>& visibility,
                    const nook::Image<float>& traced)
{
    double squares = 0, count = 0;
    for (int y = 0; y < traced.height(); ++y)
        for (int x = 0; x < traced.width(); ++x) {
            if (!view.is_surface(2 * x, 2 * y)) continue;
            const double gap = double{visibility(2 * x, 2 * y)} - double{traced(x, y)};
            squares += gap * gap;
            ++count;
        }
    return count > 0 ? std::sqrt(squares / count) : 0;
}

std::string text_of_place(const Measurement& m)
{
    return m.scene + ", " + m.kernel + (m.radius.empty() ? "" : ", R " + m.radius);
}

}  // namespace

const Kernels& chosen(const Options& options)
{
    static const Targets all = targets();
    if (options.target.empty()) return all.best();
    std::string names;
    for (int i = 0; i < all.count; ++i) {
        if (options.target == all.kernels[i]->name) return *all.kernels[i];
        names += (names.empty() ? "" : ", ") + std::string{all.kernels[i]->name};
    }
    throw Failure{"--target: '" + options.target.substr(0, 60) + "' is none of " + names};
}

std::vector<Planned> surface_kernels(const Options& options, double radius)
{
    const Kernels& best = chosen(options);
    const nook::AlchemyOptions alchemy{.radius = radius, .samples = 16};
    const nook::HorizonOptions horizon{.radius = radius};
    const nook::BitmaskOptions bitmask{.radius = radius};
    std::vector<Planned> result(3);
    result[0] = {.name = "AAO 16",
                 .samples = 16,
                 .run = [&best, alchemy](const Job& job) { return best.alchemy_ao(job, alchemy); },
                 .plan =
                     [&best, alchemy](const Job& job, const Groups& groups, double tolerance) {
                         return best.plan_alchemy(job, groups, alchemy, tolerance);
                     },
                 .tolerant = true};
    result[1] = {.name = "GTAO 3 x 6",
                 .samples = 18,
                 .run = [&best, horizon](const Job& job) { return best.horizon_ao(job, horizon); },
                 .plan =
                     [&best, horizon](const Job& job, const Groups& groups, double tolerance) {
                         return best.plan_horizon(job, groups, horizon, tolerance);
                     },
                 .tolerant = true};
    result[2] = {.name = "bitmask 3 x 6",
                 .samples = 18,
                 .run = [&best, bitmask](const Job& job) { return best.bitmask_ao(job, bitmask); },
                 .plan =
                     [&best, bitmask](const Job& job, const Groups& groups, double tolerance) {
                         return best.plan_bitmask(job, groups, bitmask, tolerance);
                     },
                 .tolerant = true};
    return result;
}

std::vector<Planned> depth_kernels(const Options& options, const View& rough, double radius)
{
    const Kernels& best = chosen(options);
    std::vector<Planned> result;
    for (const double reach : {0.0, radius}) {
        const nook::ChebyshevOptions chebyshev{.radius = reach};
        Planned kernel{
            .name = reach > 0 ? "Chebyshev, radius" : "Chebyshev 31",
            .normals = false,
            .run = [&best, chebyshev](const Job& job) { return best.chebyshev_ao(job, chebyshev); },
            .full =
                [&best, &rough, chebyshev](Job job) {
                    job.depth = rough.depth.view();
                    return best.chebyshev_ao(job, chebyshev);
                }};
        if (best.plan_depth != nullptr)
            kernel.plan = [&best, chebyshev](const Job& job, const Groups& groups, double) {
                return best.plan_depth(job, groups, chebyshev);
            };
        result.push_back(std::move(kernel));
    }
    return result;
}

Change change_of(const View& view, const nook::Image<float>& without,
                 const nook::Image<float>& with)
{
    Change result;
    double squares = 0, count = 0;
    for (int y = 0; y < view.height(); ++y)
        for (int x = 0; x < view.width(); ++x) {
            const float a = without(x, y), b = with(x, y);
            result.bits += std::bit_cast<std::uint32_t>(a) != std::bit_cast<std::uint32_t>(b);
            double gap = std::fabs(double{b} - double{a});
            if (!(gap <= 1)) gap = 1;  // not a visibility at all
            result.largest = (std::max)(result.largest, gap);
            if (!view.is_surface(x, y)) continue;
            squares += gap * gap;
            ++count;
        }
    result.rms = count > 0 ? std::sqrt(squares / count) : 0;
    return result;
}

const Measurement& measure(const Options& options, const View& view, const Planned& kernel,
                           const Extras& extras, Results& results)
{
    const Kernels& best = chosen(options);
    Measurement m;
    m.part = extras.part;
    m.scene = view.name();
    m.kernel = kernel.name;
    m.radius = extras.radius;
    m.width = view.width();
    m.height = view.height();
    Workspace workspace;
    Job plain = view.job();
    plain.workspace = &workspace;
    Buffers base{view};
    plain.visibility = base.out.view();

    std::vector<double> tolerances;
    if (kernel.plan) {
        tolerances.push_back(0);
        if (kernel.tolerant && options.tolerance > 0) tolerances.push_back(options.tolerance);
    }
    std::vector<std::unique_ptr<Buffers>> buffers;
    std::vector<Job> jobs;
    for (std::size_t i = 0; i < tolerances.size(); ++i) {
        buffers.push_back(std::make_unique<Buffers>(view));
        Job job = plain;
        job.visibility = buffers.back()->out.view();
        jobs.push_back(job);
    }
    const auto plan = [&](std::size_t i) {
        return checked(kernel.plan(jobs[i], buffers[i]->groups.view(), tolerances[i]), "a plan");
    };
    const auto under_map = [&](std::size_t i) {
        Job job = jobs[i];
        job.work_map = kernel.tolerant ? best.surface_map(buffers[i]->groups.view(), tolerances[i])
                                       : nook::WorkMap{buffers[i]->groups.view()};
        return checked(kernel.run(job), kernel.name.c_str());
    };

    // What is left out, and what that changes.
    const nook::Work work = checked(kernel.run(plain), kernel.name.c_str());
    const double surfaces = double(work.pixels - work.background);
    if (extras.traced != nullptr) m.traced_error = traced_error(view, base.out, *extras.traced);
    for (std::size_t i = 0; i < tolerances.size(); ++i) {
        const nook::Work planned = plan(i);
        const nook::Work done = under_map(i);
        PlannedTime time;
        time.plan = tolerances[i] > 0 ? "tolerant" : "exact";
        time.tolerance = tolerances[i];
        time.pixels_left_out = share_of(double(planned.skipped), surfaces);
        time.samples_left_out = share_of(double(done.skipped_samples + done.skipped_rays),
                                         kernel.samples * (surfaces - double(done.skipped)));
        time.change = change_of(view, base.out, buffers[i]->out);
        if (extras.traced != nullptr)
            time.added_error = traced_error(view, buffers[i]->out, *extras.traced) - m.traced_error;
        if (tolerances[i] == 0 && time.change.bits > 0)
            results.broken.push_back(text_of_place(m) + ": " + std::to_string(time.change.bits) +
                                     " pixels");
        m.plans.push_back(time);
        const nook::WorkMap map = kernel.tolerant
                                      ? best.surface_map(buffers[i]->groups.view(), tolerances[i])
                                      : nook::WorkMap{buffers[i]->groups.view()};
        draw_plan(options, view, map,
                  view.name() + "-" + kernel.name + "-" + extras.radius + "-" + time.plan);
    }

    // All in rotation.
    std::vector<Contender> contenders{
        {"ones", [&] { kernel.normals ? best.ones_of_both(plain) : best.ones_of_depth(plain); }},
        {"without", [&] { (void)checked(kernel.run(plain), kernel.name.c_str()); }}};
    std::size_t full = 0;
    if (kernel.full) {
        full = contenders.size();
        contenders.push_back(
            {"full", [&] { (void)checked(kernel.full(plain), kernel.name.c_str()); }});
    }
    const std::size_t first = contenders.size();
    for (std::size_t i = 0; i < tolerances.size(); ++i) {
        contenders.push_back({"with", [&, i] {
                                  (void)plan(i);
                                  (void)under_map(i);
                              }});
        contenders.push_back({"plan", [&, i] { (void)plan(i); }});
        contenders.push_back({"map", [&, i] { (void)under_map(i); }});
    }
    const Times times{contenders,
                      {.rounds = extras.rounds > 0 ? extras.rounds : options.rounds,
                       .turn_seconds = options.quick ? 1e-4 : 4e-3,
                       .untimed_call = false}};
    const auto nanoseconds = [&](std::size_t i) {
        return per_pixel(times.seconds(i), view.pixels());
    };
    m.ones = nanoseconds(0);
    m.without = nanoseconds(1);
    m.over_ones = times.ratio(1, 0);
    if (full > 0) {
        m.full = nanoseconds(full);
        m.full_speed_up = times.ratio(full, 1);
    }
    for (std::size_t i = 0; i < tolerances.size(); ++i) {
        const std::size_t with = first + 3 * i;
        m.plans[i].with = nanoseconds(with);
        m.plans[i].plan_alone = nanoseconds(with + 1);
        m.plans[i].map_alone = nanoseconds(with + 2);
        m.plans[i].speed_up = times.ratio(1, with);
        m.plans[i].reused = times.ratio(1, with + 2);
        m.plans[i].over_ones = times.ratio(with, 0);
    }
    results.measurements.push_back(m);
    return results.measurements.back();
}

void print_measurements(const std::string& title, const Results& results, std::size_t first)
{
    std::vector<std::vector<std::string>> rows{
        {"ns per pixel", "R", "plan", "ones", "without", "with", "plan", "map alone", "faster",
         "over ones", "pixels out", "samples out", "bits", "rms", "largest", "RMSE", "added"}};
    const auto short_digits = [](double value) { return digits("%.2f", value); };
    const auto percent = [](double share) { return digits("%.1f %%", 100 * share); };
    for (std::size_t i = first; i < results.measurements.size(); ++i) {
        const Measurement& m = results.measurements[i];
        const bool traced = m.traced_error >= 0;
        const std::string error = traced ? digits("%.4f", m.traced_error) : "";
        std::vector<std::string> head{m.scene + ", " + m.kernel, m.radius, "none",
                                      short_digits(m.ones.median), short_digits(m.without.median)};
        if (m.plans.empty() || m.full.median > 0) {
            std::vector<std::string> row = head;
            if (m.full.median > 0) {
                // It leaves out by itself: faster than where it cannot.
                row[4] = short_digits(m.full.median);
                row.insert(row.end(),
                           {short_digits(m.without.median), "", "", text_of(m.full_speed_up),
                            digits("%.1f", m.over_ones.median)});
                row[2] = "itself";
            } else {
                row.insert(row.end(), {"", "", "", "", digits("%.1f", m.over_ones.median)});
            }
            row.resize(rows.front().size());
            rows.push_back(row);
        }
        for (const PlannedTime& plan : m.plans) {
            std::vector<std::string> row = head;
            row[2] = plan.plan;
            row.insert(row.end(),
                       {short_digits(plan.with.median), short_digits(plan.plan_alone.median),
                        short_digits(plan.map_alone.median), text_of(plan.speed_up),
                        digits("%.1f", plan.over_ones.median), percent(plan.pixels_left_out),
                        percent(plan.samples_left_out), std::to_string(plan.change.bits),
                        digits("%.5f", plan.change.rms), digits("%.4f", plan.change.largest), error,
                        traced ? digits("%+.5f", plan.added_error) : ""});
            rows.push_back(row);
        }
    }
    std::printf("%s\n", title.c_str());
    print_table(rows);
}

Hierarchy::Hierarchy(const Options& options, const View& view)
    : bvh_{chosen(options).make_bvh(), chosen(options).free_bvh}
{
    if (bvh_ == nullptr) throw Failure{"out of memory"};
    (void)checked(chosen(options).build(bvh_.get(), view.scene.mesh()), "Bvh::build");
}

}  // namespace compare
