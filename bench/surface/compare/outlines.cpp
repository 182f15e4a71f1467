#include "parts.hpp"

#include <cstdint>
#include <cstdio>

#include <nook/scene/outline.hpp>

#include "common.hpp"
#include "scenes/scenes.hpp"

namespace compare {

void compare_outlines(const Options& options, Results& results)
{
    const int width = options.quick ? 270 : 1080, height = options.quick ? 180 : 720;
    const scenes::Scene scene = scenes::load("temple", double(width) / height);
    const Picture picture = drawn_picture(scene, width, height);
    nook::OutlineShell shell;
    (void)checked(shell.build(scene.mesh()), "OutlineShell::build");
    const OutlineJob outlines{shell.view(), shell.needed_extent(picture.radius), picture.frame};
    const int threshold = 2 - static_cast<int>(shell.inward_count());

    const Kernels& best = targets().best();
    const nook::AlchemyOptions textbook{
        .radius = picture.radius, .samples = 16, .pattern = nook::SamplePattern::pixel};
    const nook::AlchemyOptions obscurance = alchemy(picture, 16);
    nook::Image<float> noisy{width, height}, blurred{width, height};
    nook::Image<std::uint8_t> groups{nook::WorkMap::groups(width), height};
    Job job = picture.job();
    job.visibility = noisy.view();

    const auto mask = [&](const Job& own) {
        return best.outline_mask(own, outlines, groups.view(), {.threshold = threshold});
    };
    const auto masked = [&](const Job& own) {
        Job under_map = own;
        under_map.work_map = nook::outline_work_map(groups.view());
        return under_map;
    };
    const auto scalar = [&](const Job& own) {
        best.textbook_ao(own, textbook);
        return nook::Outcome{};
    };
    const auto fast = [&](const Job& own) { return best.alchemy_ao(own, obscurance); };
    const auto blur = [&](Job own) {
        own.visibility = blurred.view();
        return best.bilateral_blur(own, noisy.view(), {.radius = 4});
    };
    enum : std::size_t {
        scalar_full,
        scalar_masked,
        fast_full,
        fast_masked,
        fast_blurred,
        alone,
        mask_alone
    };
    const std::vector<Contender> contenders{
        nook_contender("scalar AAO", job, scalar),
        nook_contender("mask + scalar AAO", job,
                       [&](const Job& own) {
                           const nook::Outcome outcome = mask(own);
                           return outcome ? scalar(masked(own)) : outcome;
                       }),
        nook_contender("AAO", job, fast),
        nook_contender("mask + AAO", job,
                       [&](const Job& own) {
                           const nook::Outcome outcome = mask(own);
                           return outcome ? fast(masked(own)) : outcome;
                       }),
        nook_contender("AAO + blur", job,
                       [&](const Job& own) {
                           const nook::Outcome outcome = fast(own);
                           return outcome ? blur(own) : outcome;
                       }),
        nook_contender("outline_ao alone", job,
                       [&](const Job& own) {
                           return best.outline_ao(own, outlines, {.threshold = threshold});
                       }),
        nook_contender("mask", job, mask),
    };
    // What the mask leaves, and that it leaves the rest alone.
    Workspace workspace;
    job.workspace = &workspace;
    (void)checked(mask(job), "outline_mask");
    const nook::Work all = checked(fast(job), "alchemy_ao");
    const nook::Work some = checked(fast(masked(job)), "alchemy_ao");
    const double active = 1 - double(some.skipped) / double(all.pixels - all.background);

    const Times times{contenders, effort(options)};
    std::vector<std::vector<std::string>> rows{
        {"", "ms", "over scalar AAO", "over AAO", "over AAO + blur"}};
    for (std::size_t i = 0; i < contenders.size(); ++i) {
        Measurement m = measured("outline", picture, contenders, times, i,
                                 i <= scalar_masked ? scalar_full : fast_full);
        m.samples = i == alone || i == mask_alone ? 0 : 16;
        m.active = i == scalar_masked || i == fast_masked ? active : 1;
        results.measurements.push_back(m);
        rows.push_back({m.contender, digits("%.2f", 1e3 * times.seconds(i).median),
                        text_of(times.ratio(i, scalar_full)), text_of(times.ratio(i, fast_full)),
                        text_of(times.ratio(i, fast_blurred))});
    }
    std::printf(
        "%s, %d x %d, %zu triangles, %zu in its shell, 16 samples: %.1f %% of the surface\n"
        "pixels active\n",
        picture.name.c_str(), width, height, scene.triangles(), outlines.shells.triangle_count,
        100 * active);
    print_table(rows);

    const Summary left = times.ratio(scalar_masked, scalar_full);
    Mark less{"scalar AAO 16, temple: share of its time that the mask saves, itself included", true,
              0.15, 0.28};
    less.take({1 - left.median, 1 - left.upper, 1 - left.lower}, "own radius, own camera");
    Mark faster{"stand-alone outlines, temple, speed-up over AAO 16 + blur", true, 1, 1.28};
    faster.take(times.ratio(fast_blurred, alone), "own radius, own camera");
    results.marks.push_back(less);
    results.marks.push_back(faster);
    results.facts.push_back({"temple, share of surface pixels active", active});
    results.facts.push_back(
        {"temple, masked AAO over full AAO", times.ratio(fast_masked, fast_full).median});
}

}  // namespace compare
