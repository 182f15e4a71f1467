#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/checks.hpp>
#include <nook/lanes.hpp>
#include <nook/scene/channel_sums.hpp>
#include <nook/scene/viewpoint_channel.hpp>
#include <nook/scene/viewpoint_channel_rows.hpp>
#include <nook/scratch.hpp>

/// How far sets of views are from showing the polygons in the right proportions.
namespace nook::inline NOOK_TARGET::detail {

/// The distribution of the polygons that views are held against: p(O), or p(o) S(o) / Σ p(o) S(o).
class TargetDistribution {
public:
    TargetDistribution(const ViewpointChannel& channel, const double* saliency) : channel_{channel}
    {
        if (saliency == nullptr) return;
        double most = 0;
        for (std::size_t o = 0; o < channel.polygon_count(); ++o)
            if (channel.seen(o)) most = larger(most, saliency[o]);
        if (!(most > 0)) return;
        // By about the largest, so that products do not underflow. A power of two, as the reciprocal of
        // a number near the ends of the range may be lost.
        scale_ = power_of_two(-channel_exponent(most));
        saliency_ = saliency;
        LongSum sum;
        for (std::size_t o = 0; o < channel.polygon_count(); ++o) sum.add(product(o));
        sum_ = sum.total();
    }
    /// 0 for a polygon that takes no part.
    [[nodiscard]] double operator[](std::size_t o) const
    {
        const double p = saliency_ == nullptr ? channel_.p_polygon(o) : product(o) / sum_;
        // Quotients by what is smaller might overflow.
        return p > 0x1p-900 ? p : 0;
    }

private:
    [[nodiscard]] double product(std::size_t o) const
    {
        return channel_.p_polygon(o) * rounded(saliency_[o] * scale_);
    }

    const ViewpointChannel& channel_;
    const double* saliency_ = nullptr;
    double scale_ = 1, sum_ = 0;
};

/// Candidates beside a set of views that has been chosen.
///
/// With P(o) = Σ q(v, o) over the chosen, P = Σ P(o), and likewise p = Σ q(i, o) for a candidate i, the
/// merged distribution is (P(o) + q(i, o)) / (P + p), and with g(x) = x log2(x / target(o))
///     KL = (Σ g(P(o)) + Σ [g(P(o) + q(i, o)) − g(P(o))]) / (P + p) − log2(P + p).
/// The first sum is common to all candidates and takes over the second of the one that is chosen; the
/// second has terms only where i sees something.
template <class E>
class ViewMerger {
public:
    ViewMerger(ScratchLayout& memory, const ViewpointChannel& channel, const double* saliency,
               E& executor)
        : channel_{channel},
          target_{channel, saliency},
          executor_{executor},
          sums_{channel.rows(), static_cast<int>(executor.concurrency()), memory},
          mass_{memory.take<double>(channel.view_count())},
          chosen_{memory.take<std::uint8_t>(channel.view_count())}
    {}
    /// Reads the channel for Σ q of the views.
    void start()
    {
        for (std::size_t v = 0; v < channel_.view_count(); ++v) chosen_[v] = 0;
        const auto add = [&](std::size_t o, double* sums) {
            if (target_[o] > 0)
                channel_.for_each_view(o, [&](std::size_t v, double, double q) { sums[v] += q; });
        };
        sums_.run(channel_.rows(), mass_, add, executor_);
        for (std::size_t v = 0; v < channel_.view_count(); ++v) total_mass_ += mass_[v];
    }
    /// Reads the channel for the second sums of the candidates.
    void run()
    {
        const auto add = [&](std::size_t o, double* sums) {
            const double target = target_[o];
            if (!(target > 0)) return;
            double before = 0;
            channel_.for_each_view(
                o, [&](std::size_t v, double, double q) { before += chosen_[v] != 0 ? q : 0; });
            const double g = before > 0 ? before * std::log2(before / target) : 0;
            channel_.for_each_view(o, [&](std::size_t v, double, double q) {
                const double after = before + q;
                sums[v] += after * std::log2(after / target) - g;
            });
        };
        sums_.run(channel_.rows(), sums_.result, add, executor_);
    }
    void choose(std::size_t v)
    {
        chosen_[v] = 1;
        chosen_sum_ += sums_.result[v];
        chosen_mass_ += mass_[v];
    }
    /// It is not chosen and sees something that matters.
    [[nodiscard]] bool candidate(std::size_t v) const { return chosen_[v] == 0 && mass_[v] > 0; }
    /// What a candidate and the chosen leave when they are merged, and how probable they are together.
    [[nodiscard]] double information(std::size_t v) const
    {
        const double mass = chosen_mass_ + mass_[v];
        return (std::max)((chosen_sum_ + sums_.result[v]) / mass - std::log2(mass), 0.0);
    }
    [[nodiscard]] double probability(std::size_t v) const
    {
        return (chosen_mass_ + mass_[v]) / total_mass_;
    }

private:
    const ViewpointChannel& channel_;
    TargetDistribution target_;
    E& executor_;
    ViewSums sums_;
    double* mass_;
    std::uint8_t* chosen_;
    double total_mass_ = 0, chosen_mass_ = 0, chosen_sum_ = 0;
};

}  // namespace nook::inline NOOK_TARGET::detail
