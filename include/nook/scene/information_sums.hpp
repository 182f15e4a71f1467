#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <nook/lanes.hpp>
#include <nook/scratch.hpp>

/// The sums behind a polygon's mutual information, taken up view by view.
namespace nook::inline NOOK_TARGET::detail {

/// With weights w_v of any sum W over the views that see something, p(v) = w_v / W, and
///     Q(o) = Σ_v w_v a(v, o) / a_v = W p(o)
///     S(o) = Σ_v w_v a(v, o) / a_v · log2(a(v, o) / a_v)
/// give PMI(o) = S / Q + log2(W / Q): what González, Sbert & Feixas 2008, equation 10, say, without
/// the matrix. For the paper's p(v), w_v = a_v: Q is the number of samples that show o, and W of all.
class InformationSums {
public:
    struct Arrays {
        /// Samples of the view that is being taken up.
        std::uint32_t* counts;
        /// Samples in all views, modulo 2³², and a polygon for each time that they went round.
        std::uint32_t *samples, *rounds;
        double* logarithms;
        /// Q, or null: the samples.
        double* weights;
        double* log_table;
    };
    /// `weighted`: p(v) is not the paper's. `most_samples`: of all polygons in all views together.
    [[nodiscard]] static Arrays take(ScratchLayout& layout, std::size_t polygons, bool weighted,
                                     std::uint64_t most_samples)
    {
        Arrays arrays{};
        arrays.counts = layout.take<std::uint32_t>(polygons);
        arrays.samples = layout.take<std::uint32_t>(polygons);
        arrays.rounds = layout.take<std::uint32_t>(static_cast<std::size_t>(most_samples >> 32));
        arrays.logarithms = layout.take<double>(polygons);
        arrays.weights = weighted ? layout.take<double>(polygons) : nullptr;
        arrays.log_table = layout.take<double>(table_size);
        return arrays;
    }

    InformationSums(std::size_t polygons, const Arrays& arrays)
        : polygons_{polygons},
          arrays_{arrays}
    {
        for (std::size_t o = 0; o < polygons; ++o) {
            arrays_.samples[o] = 0;
            arrays_.logarithms[o] = 0;
            if (arrays_.weights != nullptr) arrays_.weights[o] = 0;
        }
        arrays_.log_table[0] = 0;
        for (std::uint32_t i = 1; i < table_size; ++i) arrays_.log_table[i] = std::log2(double(i));
    }

    [[nodiscard]] std::uint32_t* counts() const { return arrays_.counts; }

    /// Takes up the view in `counts`; `weight` > 0 means nothing unless the sums are weighted. Returns
    /// false, and nothing changes, if the view sees nothing.
    template <class E>
    bool add(double weight, E& executor)
    {
        std::atomic<std::uint64_t> sum{0};
        for_each_block(executor, [&](std::size_t begin, std::size_t end) {
            std::uint64_t part = 0;
            for (std::size_t o = begin; o < end; ++o) part += arrays_.counts[o];
            sum.fetch_add(part, std::memory_order_relaxed);
        });
        if (sum.load() == 0) return false;
        const double area = static_cast<double>(sum.load()), log_area = std::log2(area);
        const bool weighted = arrays_.weights != nullptr;
        total_ += weighted ? weight : area;
        const double scale = weighted ? weight / area : 1;
        for_each_block(executor, [&](std::size_t begin, std::size_t end) {
            for (std::size_t o = begin; o < end; ++o) {
                const std::uint32_t count = arrays_.counts[o];
                if (count == 0) continue;
                const double share = scale * count;
                arrays_.logarithms[o] += share * (log2_of(count) - log_area);
                if (weighted) arrays_.weights[o] += share;
                arrays_.samples[o] += count;
                if (arrays_.samples[o] < count)
                    arrays_.rounds[round_count_.fetch_add(1, std::memory_order_relaxed)] =
                        static_cast<std::uint32_t>(o);
            }
        });
        return true;
    }
    /// Ends the sums: what follows may be asked for.
    void finish() { std::sort(arrays_.rounds, arrays_.rounds + round_count_.load(), Less{}); }

    [[nodiscard]] double samples(std::size_t o) const
    {
        std::uint64_t sum = arrays_.samples[o];
        const std::uint32_t* const end = arrays_.rounds + round_count_.load();
        const std::uint32_t* at = arrays_.rounds;
        if (at == end) return static_cast<double>(sum);
        const auto polygon = static_cast<std::uint32_t>(o);
        for (at = std::lower_bound(at, end, polygon, Less{}); at != end && *at == polygon; ++at)
            sum += std::uint64_t{1} << 32;
        return static_cast<double>(sum);
    }
    [[nodiscard]] bool seen(std::size_t o) const { return samples(o) > 0; }
    /// Bits, of a polygon that is seen. Rounding may leave a little less than 0.
    [[nodiscard]] double information(std::size_t o) const
    {
        const double weight = arrays_.weights != nullptr ? arrays_.weights[o] : samples(o);
        return larger(arrays_.logarithms[o] / weight + std::log2(total_ / weight), 0.0);
    }
    /// Room for one double per polygon: its S(o) is lost.
    [[nodiscard]] double* results() const { return arrays_.logarithms; }

    /// Calls f(begin, end) for blocks of polygons, in parallel.
    template <class E, class F>
    void for_each_block(E& executor, const F& f) const
    {
        executor.for_each(static_cast<int>((polygons_ + block - 1) / block), [&](int task, int) {
            const std::size_t begin = static_cast<std::size_t>(task) * block;
            f(begin, polygons_ - begin < block ? polygons_ : begin + block);
        });
    }

private:
    static constexpr std::size_t block = 8192;
    /// Larger counts are so few that their logarithms cost nothing.
    static constexpr std::uint32_t table_size = 4096;

    /// Of this target, so that the algorithm is.
    struct Less {
        bool operator()(std::uint32_t a, std::uint32_t b) const { return a < b; }
    };
    [[nodiscard]] double log2_of(std::uint32_t count) const
    {
        return count < table_size ? arrays_.log_table[count] : std::log2(double(count));
    }

    std::size_t polygons_;
    Arrays arrays_;
    double total_ = 0;
    std::atomic<std::uint32_t> round_count_{0};
};

}  // namespace nook::inline NOOK_TARGET::detail
