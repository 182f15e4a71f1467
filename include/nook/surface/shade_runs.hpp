#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include <nook/depth/source.hpp>
#include <nook/depth/source_row.hpp>
#include <nook/image.hpp>
#include <nook/lanes.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>
#include <nook/work_map.hpp>

/// What the blur and the upsampling leave out. A weighted mean of ones is exactly 1, whatever the weights:
/// groups of 16 pixels whose windows hold nothing but ones need no weights, and nobody needs the depths
/// and normals around them. So both find out from the visibilities alone where there is shade, some rows
/// ahead of their work.
namespace nook::inline NOOK_TARGET::detail {

/// Columns of neighbouring groups that are treated alike.
struct GroupRun {
    int begin, end;  ///< pixels; the end is that of a group or the width
};
/// Calls body(run, wanted) for the runs of a row that are wanted and those that are not; `wanted` holds 1
/// or 0 per group.
template <class Body>
NOOK_INLINE void for_each_run(const std::uint8_t* wanted, int width, const Body& body)
{
    const int groups = WorkMap::groups(width);
    for (int first = 0, last = 0; first < groups; first = last) {
        const bool is_wanted = wanted[first] != 0;
        const void* const other = std::memchr(wanted + first, is_wanted ? 0 : 1,
                                              static_cast<std::size_t>(groups - first));
        last = other == nullptr
                   ? groups
                   : static_cast<int>(static_cast<const std::uint8_t*>(other) - wanted);
        body(GroupRun{first * WorkMap::group, (std::min)(last * WorkMap::group, width)}, is_wanted);
    }
}

/// Is any value in columns [first, last) of a row not exactly 1? By their bits, so that NaN never is.
template <int lanes, class In>
[[nodiscard]] NOOK_INLINE bool has_shade(const In* row, std::ptrdiff_t stride, int first, int last)
{
    using Value = std::remove_const_t<In>;
    using Bits = std::conditional_t<sizeof(Value) == 4, std::int32_t, std::int64_t>;
    constexpr Bits one = std::bit_cast<Bits>(Value{1});
    if (stride == 1 && last - first >= lanes) {
        const auto differing = [&](int x) NOOK_INLINE_LAMBDA {
            return std::bit_cast<Lanes<Bits, lanes>>(load<lanes>(row + x)) ^ one;
        };
        auto differences = differing(last - lanes);
        for (int x = first; x < last - lanes; x += lanes) differences |= differing(x);
        return any(differences != Bits{0});
    }
    for (int x = first; x < last; ++x)
        if (std::bit_cast<Bits>(row[x * stride]) != one) return true;
    return false;
}

/// The columns of a row of `count` values that the groups of an image look at: group g those from
/// g step − before to before (g + 1) step + after.
struct ShadeWindow {
    int count, step, before, after;
};
/// Tells for each group whether it looks at shade in this row.
template <class In>
void find_shade(const In* row, std::ptrdiff_t stride, const ShadeWindow& window, int groups,
                std::uint8_t* shade)
{
    constexpr int most =
        std::is_same_v<std::remove_const_t<In>, float> ? float_lanes : native_lanes;
    // Windows hold eight columns at least.
    constexpr int lanes = most > 8 ? 8 : most, stretch = 256;
    const int count = window.count;
    int bright = 0;
    while (bright < count &&
           !has_shade<most>(row, stride, bright, (std::min)(bright + stretch, count)))
        bright += stretch;
    int group = 0;
    if (bright >= count) group = groups;
    else if (bright > window.after) group = (bright - window.after) / window.step;
    std::fill_n(shade, group, std::uint8_t{0});
    for (; group < groups; ++group) {
        const int first = group * window.step - window.before;
        const int last = (group + 1) * window.step + window.after;
        shade[group] =
            has_shade<lanes>(row, stride, (std::max)(first, 0), (std::min)(last, count)) ? 1 : 0;
    }
}

/// Writes ones to the pixels of a run.
template <class Out>
void write_ones(const ImageView<Out>& image, const GroupRun& run, int y)
{
    Out* const out = &image(0, y);
    if (image.pixel_stride == 1) {
        std::fill(out + run.begin, out + run.end, Out{1});
        return;
    }
    for (int x = run.begin; x < run.end; ++x) out[x * image.pixel_stride] = Out{1};
}

/// Which groups of a band of rows there is work for, found out from the shaded ones a row at a time.
/// Three times `reach` rows lie between a row that is looked at and the one that is written:
///   shade(row)            is any value of the window's columns in this row not 1?
///   work(row − reach)     is there shade within reach of it?
///   needed(row − 2 reach) is there work within reach of it?
class ShadePlan {
public:
    ShadePlan(int width, int reach)
        : groups_{WorkMap::groups(width)},
          slots_{2 * reach + 1},
          stride_{(groups_ + most_beside + lanes - 1) / lanes * lanes}
    {}
    /// A byte per group.
    struct Memory {
        std::uint8_t* bytes;
    };
    [[nodiscard]] Memory take(ScratchLayout& block, std::size_t workers) const
    {
        return {block.take<std::uint8_t>(workers * size())};
    }
    [[nodiscard]] Memory of(const Memory& memory, int worker) const
    {
        return {memory.bytes + static_cast<std::size_t>(worker) * size()};
    }

    /// Before the first row.
    void clear(const Memory& memory) const
    {
        std::fill_n(memory.bytes, size(), std::uint8_t{0});
        std::fill_n(since_shade(memory), stride_, never);
        std::fill_n(since_work(memory), stride_, never);
    }
    [[nodiscard]] int groups() const { return groups_; }
    void clear(std::uint8_t* row) const { std::fill_n(row, stride_, std::uint8_t{0}); }
    [[nodiscard]] bool any(const std::uint8_t* row) const
    {
        Bytes found{};
        for (int i = 0, end = stride_; i < end; i += lanes) found |= load<lanes>(row + i);
        return detail::any(found != Bytes{});
    }
    /// Rows from −3 reach on; each stays for 2 reach further ones.
    [[nodiscard]] std::uint8_t* shade(const Memory& memory, int row) const
    {
        return plane(memory, slot(row));
    }
    [[nodiscard]] std::uint8_t* work(const Memory& memory, int row) const
    {
        return plane(memory, slots_ + slot(row));
    }
    /// Of the row in question, where there is shade and it is needed.
    [[nodiscard]] std::uint8_t* mixed(const Memory& memory) const
    {
        return plane(memory, 2 * slots_);
    }
    [[nodiscard]] std::uint8_t* needed(const Memory& memory) const
    {
        return plane(memory, 2 * slots_ + 1);
    }

    /// Makes work(row − reach) of what lies within reach of shade, when shade(row) has been written.
    void find_work(const Memory& memory, int row) const
    {
        std::uint8_t* const since = since_shade(memory);
        std::uint8_t* const found = work(memory, row - slots_ / 2);
        const std::uint8_t* const shaded = shade(memory, row);
        for (int i = 0, end = stride_; i < end; i += lanes) {
            const Bytes rows = aged(load<lanes>(since + i), load<lanes>(shaded + i));
            store(since + i, rows);
            store(found + i, within(rows));
        }
    }
    /// Makes work(row) of where there is shade in one row or the other.
    void find_work(const Memory& memory, int row, const std::uint8_t* a,
                   const std::uint8_t* b) const
    {
        std::uint8_t* const found = work(memory, row);
        for (int i = 0, end = stride_; i < end; i += lanes)
            store(found + i, static_cast<Bytes>(load<lanes>(a + i) | load<lanes>(b + i)));
    }
    /// What is inactive is no work; to be called for each row of work when it has been written.
    void set_work(const Memory& memory, int row, const WorkMap& map) const
    {
        std::uint8_t* const since = since_work(memory);
        std::uint8_t* const found = work(memory, row);
        if (!map.everything() && any(found))
            for (int i = 0; i < groups_; ++i)
                if (!map.is_active(i * WorkMap::group, row)) found[i] = 0;
        for (int i = 0, end = stride_; i < end; i += lanes)
            store(since + i, aged(load<lanes>(since + i), load<lanes>(found + i)));
    }
    /// Makes needed(row − reach), when `set_work` has been called for the row: groups within reach above
    /// and below, and those beside the mixed ones, which are read sideways: the shaded ones, or all of
    /// them. Tells whether there are any.
    bool find_needed(const Memory& memory, const std::uint8_t* shaded = nullptr) const
    {
        const std::uint8_t* const since = since_work(memory);
        std::uint8_t* const wanted = needed(memory);
        std::uint8_t* const both = mixed(memory);
        Bytes found{};
        for (int i = 0, end = stride_; i < end; i += lanes) {
            const Bytes in_reach = within(load<lanes>(since + i));
            found |= in_reach;
            store(wanted + i, in_reach);
            store(both + i, shaded == nullptr
                                ? in_reach
                                : static_cast<Bytes>(in_reach & load<lanes>(shaded + i)));
        }
        if (!detail::any(found != Bytes{})) return false;
        const int reach = slots_ / 2, beside = (reach + WorkMap::group - 1) / WorkMap::group;
        for (int i = 0, end = stride_; i < end; i += lanes) {
            Bytes marks = load<lanes>(wanted + i);
            for (int step = 1; step <= beside; ++step)
                marks = static_cast<Bytes>(marks | load<lanes>(both + i - step) |
                                           load<lanes>(both + i + step));
            store(wanted + i, marks);
        }
        return true;
    }

private:
    static constexpr std::uint8_t never = 255;
    /// Groups at most to each side that are read together with one; the rest of a row is 0.
    static constexpr int most_beside = 4;
    static constexpr int lanes = native_lanes == 1 ? 1 : 16;
    using Bytes = Lanes<std::uint8_t, lanes>;

    [[nodiscard]] std::uint8_t* plane(const Memory& memory, int index) const
    {
        return memory.bytes + std::ptrdiff_t{index} * stride_;
    }
    [[nodiscard]] int slot(int row) const { return (row + 3 * slots_) % slots_; }
    [[nodiscard]] std::uint8_t* since_shade(const Memory& memory) const
    {
        return plane(memory, 2 * slots_ + 2);
    }
    [[nodiscard]] std::uint8_t* since_work(const Memory& memory) const
    {
        return plane(memory, 2 * slots_ + 3);
    }
    [[nodiscard]] std::size_t size() const
    {
        return static_cast<std::size_t>(2 * slots_ + 4) * static_cast<std::size_t>(stride_);
    }
    /// Rows since the last one that was marked, one row on.
    [[nodiscard]] NOOK_INLINE static Bytes aged(const Bytes& rows, const Bytes& marked)
    {
        const Bytes zero{}, one = static_cast<Bytes>(zero + std::uint8_t{1});
        const Bytes step = rows != never ? one : zero;
        const Bytes older = static_cast<Bytes>(rows + step);
        return marked != zero ? zero : older;
    }
    [[nodiscard]] NOOK_INLINE Bytes within(const Bytes& rows) const
    {
        const Bytes zero{}, one = static_cast<Bytes>(zero + std::uint8_t{1});
        return rows < static_cast<std::uint8_t>(slots_) ? one : zero;
    }

    int groups_, slots_, stride_;
};

/// Counts the pixels of a run whose depth nobody needs.
template <int lanes, class Source>
void count_spared(Work& work, const Source& source, const GroupRun& run, int y)
{
    const int count = run.end - run.begin;
    const std::uint64_t surfaces = count_surfaces<lanes>(source, run.begin, count, y);
    work.background += static_cast<std::uint64_t>(count) - surfaces;
    work.skipped += surfaces;
}

/// The outcome of a pass over all pixels, which may have found nothing to do.
inline void count_pass(Work& work, int width, int height)
{
    work.pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    const bool idle = work.background + work.skipped == work.pixels;
    work.passes = idle ? 0 : 1;
    work.skipped_passes = idle ? 1 : 0;
}

}  // namespace nook::inline NOOK_TARGET::detail
