#include "parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include "compare/pinned.hpp"
#include "compare/table.hpp"
#include "kernels.hpp"
#include "llvmpipe.hpp"

namespace compare {

namespace {

constexpr Target all_targets[] = {Target::facets, Target::facets_interleaved,
                                  Target::smooth, Target::depth,
                                  Target::faces,  Target::counts};

/// What llvmpipe draws in place of a target of nook.
[[nodiscard]] Target counterpart(Target target)
{
    switch (target) {
    case Target::facets_interleaved: return Target::facets;
    case Target::counts: return Target::faces;
    default: return target;
    }
}

struct Marks {
    Mark facets_of_many{"depth + facet normal, 300 k triangles and more, speed-up over llvmpipe",
                        true, 3, 6};
    Mark facets_of_few{"depth + facet normal, fewer triangles, speed-up over llvmpipe", true, 2, 4};
    Mark smooth_of_many{"depth + smooth normal, 300 k triangles and more, speed-up over llvmpipe",
                        true, 3, 6};
    Mark smooth_of_few{"depth + smooth normal, fewer triangles, speed-up over llvmpipe", true, 2,
                       4};
};

/// Both rasterisers over one view.
class Contest {
public:
    explicit Contest(const View& view) : view_{view}, buffers_{view}
    {
        if (!llvmpipe_version().empty()) peer_ = std::make_unique<LlvmpipeView>(view);
    }

    [[nodiscard]] std::vector<Agreement> agreements()
    {
        std::vector<Agreement> result;
        for (const Target target : {Target::facets, Target::smooth, Target::faces}) {
            if (!peer_ || !peer_->draws(target)) continue;
            draw(best_, target, view_, buffers_, workspace_);
            peer_->draw(target);
            result.push_back(target == Target::faces ? compared_faces() : compared_normals());
            result.back().view = view_.name();
            result.back().what = text_of(target);
        }
        return result;
    }

    void run(const Options& options, Results& results, Marks& marks)
    {
        std::vector<Contender> contenders;
        std::optional<std::size_t> peers[std::size(all_targets)];
        for (const Target target : all_targets)
            contenders.push_back({text_of(target), [this, target] {
                                      draw(best_, target, view_, buffers_, workspace_);
                                  }});
        for (const Target target : all_targets) {
            if (!peer_ || counterpart(target) != target || !peer_->draws(target)) continue;
            peers[index(target)] = contenders.size();
            contenders.push_back({std::string{"llvmpipe: "} + text_of(target),
                                  [this, target] { peer_->draw(target); }});
        }
        peers[index(Target::facets_interleaved)] = peers[index(Target::facets)];
        if (peers[index(Target::faces)]) {
            peers[index(Target::counts)] = contenders.size();
            contenders.push_back({"llvmpipe: face ids, read and counted", [this] {
                                      peer_->draw(Target::faces);
                                      peer_->count_faces(buffers_.counts);
                                  }});
        }
        const Times times{contenders, effort(options)};

        std::vector<std::vector<std::string>> rows{
            {"", "ms", "least", "Mtriangles/s", "llvmpipe, ms", "llvmpipe over nook"}};
        for (const Target target : all_targets) {
            const std::size_t own = index(target);
            const double seconds = times.seconds(own).median;
            const std::optional<std::size_t> peer = peers[own];
            rows.push_back({text_of(target), digits("%.2f", 1e3 * seconds),
                            digits("%.2f", 1e3 * times.least_seconds(own)),
                            digits("%.1f", 1e-6 * double(view_.mesh->triangles()) / seconds),
                            peer ? digits("%.2f", 1e3 * times.seconds(*peer).median) : "-",
                            peer ? text_of(times.ratio(*peer, own)) : "-"});
        }
        std::printf("%s: one thread, nook %s\n", view_.name().c_str(), best_.name);
        print_table(rows);

        for (std::size_t i = 0; i < contenders.size(); ++i)
            results.measurements.push_back(
                measured("llvmpipe", view_, contenders, times, i,
                         i < std::size(all_targets) ? peers[i].value_or(i) : i));
        const bool large = view_.mesh->triangles() >= 250'000;
        const auto take = [&](Mark& mark, Target own, Target peer) {
            if (peers[index(peer)])
                mark.take(
                    times.ratio(*peers[index(peer)], index(own)),
                    view_.name() + (own == peer ? "" : std::string{", over "} + text_of(peer)));
        };
        Mark& facets = large ? marks.facets_of_many : marks.facets_of_few;
        take(facets, Target::facets, Target::facets);
        // Which of them llvmpipe is faster at depends on the mesh.
        take(facets, Target::facets, Target::smooth);
        take(large ? marks.smooth_of_many : marks.smooth_of_few, Target::smooth, Target::smooth);
        const auto report = [&](Target target) {
            const std::optional<std::size_t> peer = peers[index(target)];
            if (peer)
                results.facts.push_back(
                    {view_.name() + ", " + text_of(target) + ", llvmpipe over nook",
                     times.ratio(*peer, index(target)).median});
        };
        report(Target::depth);
        report(Target::counts);
    }

private:
    [[nodiscard]] static std::size_t index(Target target)
    {
        return static_cast<std::size_t>(
            std::find(std::begin(all_targets), std::end(all_targets), target) -
            std::begin(all_targets));
    }

    [[nodiscard]] Agreement compared_normals()
    {
        const std::vector<float> theirs = peer_->read_normals();
        const nook::ImageView3<float> ours = buffers_.planar();
        return compared([&](int x, int y, std::size_t i) {
            const float* const n = &theirs[4 * i];
            // Up to its sign: nook turns normals towards the viewer.
            const float product = ours.x(x, y) * n[0] + ours.y(x, y) * n[1] + ours.z(x, y) * n[2];
            return Pixel{n[3] > 0, std::fabs(product) > cosine};
        });
    }

    [[nodiscard]] Agreement compared_faces()
    {
        const std::vector<std::uint32_t> theirs = peer_->read_faces();
        return compared([&](int x, int y, std::size_t i) {
            return Pixel{theirs[i] != nook::no_face, theirs[i] == buffers_.face(x, y)};
        });
    }

    struct Pixel {
        bool covered, same;
    };

    /// `peer(x, y, i)` tells of a pixel of llvmpipe.
    template <class Peer>
    [[nodiscard]] Agreement compared(const Peer& peer) const
    {
        Agreement result;
        std::size_t i = 0;
        for (int y = 0; y < view_.height; ++y)
            for (int x = 0; x < view_.width; ++x, ++i) {
                const bool covered = std::isfinite(buffers_.depth(x, y));
                const Pixel pixel = peer(x, y, i);
                result.covered += covered;
                result.coverage += covered != pixel.covered;
                result.different += covered && pixel.covered && !pixel.same;
            }
        for (double* const share : {&result.covered, &result.coverage, &result.different})
            *share /= double(i);
        return result;
    }

    /// Of one degree and a half: a component changes by no more than 6/255.
    static constexpr float cosine = 0.99965f;

    const View& view_;
    const Kernels& best_ = targets().best();
    Buffers buffers_;
    Workspace workspace_;
    std::unique_ptr<LlvmpipeView> peer_;
};

void print_agreements(const std::vector<Agreement>& agreements)
{
    if (agreements.empty()) return;
    std::vector<std::vector<std::string>> rows{
        {"", "picture", "covered", "coverage differs", "value differs"}};
    for (const Agreement& agreement : agreements)
        rows.push_back({agreement.view, agreement.what, digits("%.2f %%", 100 * agreement.covered),
                        digits("%.4f %%", 100 * agreement.coverage),
                        digits("%.4f %%", 100 * agreement.different)});
    std::printf(
        "nook's pictures against llvmpipe's, shares of all pixels; a normal differs from 1.5 "
        "degrees on\n");
    print_table(rows);
}

}  // namespace

void compare_llvmpipe(const Options& options, const std::vector<View>& views, Results& results)
{
    Marks marks;
    if (llvmpipe_version().empty())
        std::printf(
            "llvmpipe: not measured, there is no EGL context with this renderer; nook's own "
            "figures\n\n");
    const Pinned pinned;
    std::vector<Agreement> agreements;
    for (const View& view : views) {
        Contest contest{view};
        for (const Agreement& agreement : contest.agreements()) agreements.push_back(agreement);
        contest.run(options, results, marks);
    }
    print_agreements(agreements);
    results.agreements.insert(results.agreements.end(), agreements.begin(), agreements.end());
    for (const Mark& mark :
         {marks.facets_of_many, marks.facets_of_few, marks.smooth_of_many, marks.smooth_of_few})
        results.marks.push_back(mark);
}

}  // namespace compare
