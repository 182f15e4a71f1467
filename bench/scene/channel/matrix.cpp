#include "parts.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "compare/failure.hpp"
#include "kernels.hpp"
#include "memory.hpp"

namespace compare {

void measure_matrix(const Options& options, Subject& subject, Results& results)
{
    const Kernels& best = targets().best();
    nook::ChannelOptions channel_options;
    channel_options.resolution = options.resolution;
    Job job = subject.job();
    std::vector<double> pmi(subject.mesh.triangles()), vmi(subject.views.size());
    nook::ChannelEntropies entropies;
    std::vector<double> build_seconds, processor_seconds, measure_seconds;
    Measurement m = measured("matrix", subject, options, options.resolution);
    for (int round = 0; round < options.rounds; ++round) {
        // New in every round, so that the first and the others do the same.
        Workspace workspace;
        CountedMemory memory;
        job.workspace = &workspace;
        const std::unique_ptr<void, void (*)(void*)> channel{best.make_channel(),
                                                             best.free_channel};
        const ResidentGrowth growth;
        nook::Work work;
        const Elapsed built = time_of([&] {
            work = checked(best.build(channel.get(), job, channel_options, memory.memory()),
                           "ViewpointChannel::build");
        });
        build_seconds.push_back(built.wall);
        processor_seconds.push_back(built.processor);
        m.facts.clear();
        double sum = 0;
        const auto timed = [&](const char* what, const auto& call) {
            const double seconds = time_of(call).wall;
            m.facts.push_back({std::string{"seconds for "} + what, seconds});
            sum += seconds;
        };
        timed("PMI", [&] {
            (void)checked(best.polygon_information(channel.get(), job, pmi.data()),
                          "polygon_mutual_information");
        });
        timed("VMI", [&] {
            (void)checked(best.viewpoint_information(channel.get(), job, vmi.data()),
                          "viewpoint_mutual_information");
        });
        timed("entropies and information, both sides", [&] {
            (void)checked(best.entropies(channel.get(), job, entropies), "channel_entropies");
        });
        measure_seconds.push_back(sum);
        m.resident = growth.most();
        m.bytes = memory.most();
        const double entries = double(best.entry_count(channel.get()));
        m.facts.push_back({"entries of the matrix", entries});
        m.facts.push_back({"share of all pairs of view and polygon",
                           entries / (std::max)(double(m.triangles) * double(m.views), 1.0)});
        m.facts.push_back({"bytes kept per entry",
                           double(best.memory_size(channel.get())) / (std::max)(entries, 1.0)});
        m.facts.push_back({"polygons not seen", double(std::count(pmi.begin(), pmi.end(), 0.0))});
        m.facts.push_back({"views of VMI 0", double(std::count(vmi.begin(), vmi.end(), 0.0))});
        if (work.pixels > 0)
            m.facts.push_back({"share of the pictures without a surface",
                               double(work.background) / double(work.pixels)});
    }
    const double by_views = entropies.information_by_views;
    const double by_polygons = entropies.information_by_polygons;
    const double by_entropies = entropies.view + entropies.polygon - entropies.joint;
    const double apart =
        (std::max)(std::fabs(by_views - by_polygons), std::fabs(by_views - by_entropies)) /
        (std::max)(by_views, 1e-300);
    m.seconds = summary_of(build_seconds);
    m.processor_seconds = summary_of(processor_seconds).median;
    m.facts.push_back({"H(V), bits", entropies.view});
    m.facts.push_back({"H(O), bits", entropies.polygon});
    m.facts.push_back({"I(V;O), bits", by_views});
    m.facts.push_back({"I(V;O) three ways, relative difference", apart});
    print_measurement(m);

    const bool agreed = as_agreed(subject, options) && options.resolution == 512;
    std::vector<double> all = build_seconds;
    for (std::size_t round = 0; round < all.size(); ++round) all[round] += measure_seconds[round];
    results.marks.push_back(mark_of("channel with PMI, VMI and I(V;O): seconds", summary_of(all),
                                    agreed ? 90 : 0, agreed ? 40 : 0, subject.name()));
    const double gigabytes = 1e-9 * double(m.bytes);
    results.marks.push_back(mark_of("channel: gigabytes, while it builds",
                                    {gigabytes, gigabytes, gigabytes}, agreed ? 1.5 : 0,
                                    agreed ? 0.8 : 0, subject.name()));
    const double error = apart * 1e12;
    results.marks.push_back(mark_of("I(V;O) three ways: relative difference, 1e-12",
                                    {error, error, error}, 1, 0, subject.name()));
    results.measurements.push_back(m);
}

}  // namespace compare
