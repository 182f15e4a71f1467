#include "parts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "compare/failure.hpp"
#include "kernels.hpp"
#include "memory.hpp"

namespace compare {

namespace {

/// Room for what the paper's maps need, unseen polygons flagged.
struct Maps {
    std::vector<float> pmi, visibility;
    std::vector<nook::PolygonState> state;

    explicit Maps(const Subject& subject)
        : pmi(subject.mesh.triangles()),
          visibility(subject.mesh.triangles()),
          state(subject.mesh.triangles())
    {}
    [[nodiscard]] nook::InformationMaps view()
    {
        nook::InformationMaps maps;
        maps.pmi = pmi.data();
        maps.visibility = visibility.data();
        maps.state = state.data();
        return maps;
    }
};

void tell(const nook::InformationReport& report, const nook::Work& work, Measurement& m)
{
    const auto& sampling = report.sampling;
    const auto& polygons = report.polygons;
    m.facts.push_back({"polygons with 1 sample per pixel", double(sampling.polygons[0])});
    m.facts.push_back({"polygons with 4", double(sampling.polygons[1])});
    m.facts.push_back({"polygons with 16", double(sampling.polygons[2])});
    m.facts.push_back({"of them with fewer samples than wanted", double(sampling.below_target)});
    m.facts.push_back({"back faces left out (1) or drawn (0)",
                       report.back_faces == nook::BackFaces::left_out ? 1.0 : 0.0});
    m.facts.push_back({"views not drawn", double(m.views - report.views)});
    m.facts.push_back({"views that see nothing", double(report.blind_views)});
    m.facts.push_back({"polygons seen", double(polygons.seen)});
    m.facts.push_back({"polygons hidden", double(polygons.hidden)});
    m.facts.push_back({"polygons unseen for lack of samples", double(polygons.too_small)});
    m.facts.push_back({"polygons without area", double(polygons.unusable)});
    m.facts.push_back({"polygons turned away from all views", double(polygons.turned_away)});
    // In units of the finest sample, if there are several.
    const double units = sampling.polygons[1] + sampling.polygons[2] > 0 ? 16 : 1;
    if (work.pixels > 0) {
        m.facts.push_back({"share of the pictures without a surface",
                           double(work.background) / units / double(work.pixels)});
        m.facts.push_back({"samples per pixel", double(work.samples) / double(work.pixels)});
    }
}

}  // namespace

void measure_stream(const Options& options, Subject& subject, Results& results)
{
    Maps maps{subject};
    nook::InformationReport report;
    nook::Work work;
    std::size_t bytes = 0;
    std::optional<std::size_t> resident;
    std::vector<double> seconds, processor;
    for (int round = 0; round < options.rounds; ++round) {
        // New in every round, so that the first and the others do the same.
        Workspace workspace;
        Job job = subject.job();
        job.workspace = &workspace;
        const ResidentGrowth growth;
        const Elapsed elapsed = time_of([&] {
            work = checked(targets().best().information_ao(job, maps.view(), {}, report),
                           "information_ao");
        });
        seconds.push_back(elapsed.wall);
        processor.push_back(elapsed.processor);
        bytes = workspace.size();
        resident = growth.most();
    }
    Measurement m = measured("stream", subject, options, report.sampling.resolution);
    m.seconds = summary_of(seconds);
    m.processor_seconds = summary_of(processor).median;
    m.bytes = bytes;
    m.resident = resident;
    tell(report, work, m);
    print_measurement(m);

    const bool agreed = as_agreed(subject, options);
    results.marks.push_back(mark_of("PMI and occlusion, streamed: seconds", m.seconds,
                                    agreed ? 90 : 0, agreed ? 40 : 0, subject.name()));
    const double each = per_polygon(m, bytes);
    results.marks.push_back(
        mark_of("PMI and occlusion, streamed: bytes per polygon beside mesh and picture",
                {each, each, each}, 32, 0, subject.name()));
    results.measurements.push_back(m);
}

void measure_refinement(const Options& options, Subject& subject, Results& results)
{
    const auto map_of = [&] {
        Maps maps{subject};
        Workspace workspace;
        nook::InformationReport report;
        Job job = subject.job();
        job.workspace = &workspace;
        (void)checked(targets().best().information_ao(job, maps.view(), {}, report),
                      "information_ao");
        return maps.pmi;
    };
    const std::vector<float> coarse = map_of();
    const std::size_t before = subject.views.size();
    std::vector<float> fine;
    subject.look_from(options.level + 1);
    const Elapsed elapsed = time_of([&] { fine = map_of(); });
    Measurement m = measured("refinement", subject, options, 0);
    subject.look_from(options.level);

    double squares = 0, apart = 0, sum = 0, compared = 0;
    for (std::size_t o = 0; o < coarse.size(); ++o) {
        if (!(coarse[o] > 0) || !(fine[o] > 0)) continue;
        const double gap = double{coarse[o]} - double{fine[o]};
        squares += double{fine[o]} * double{fine[o]};
        apart += gap * gap;
        sum += double{fine[o]};
        ++compared;
    }
    const double change = squares > 0 ? std::sqrt(apart / squares) : 0;
    m.seconds = {elapsed.wall, elapsed.wall, elapsed.wall};
    m.processor_seconds = elapsed.processor;
    m.facts = {{"polygons that both levels see", compared},
               {"mean PMI of the finer level, bits", compared > 0 ? sum / compared : 0},
               {"rms change of PMI, relative to its rms", change},
               {"rms change of PMI, bits", compared > 0 ? std::sqrt(apart / compared) : 0}};
    print_measurement(m);
    results.marks.push_back(mark_of("PMI from " + std::to_string(before) + " to " +
                                        std::to_string(m.views) + " views: rms change",
                                    {change, change, change}, before == 642 ? 0.02 : 0, 0,
                                    subject.mesh.name));
    results.measurements.push_back(m);
}

}  // namespace compare
