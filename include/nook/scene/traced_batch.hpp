#pragma once

#include <algorithm>
#include <cstdint>

#include <nook/outcome.hpp>
#include <nook/scene/neighbourhood.hpp>
#include <nook/scene/traced_images.hpp>
#include <nook/scene/traced_point.hpp>
#include <nook/scene/vector.hpp>

namespace nook::inline NOOK_TARGET::detail {

/// Up to 64 shading points that are traced together, with the pixels they belong to.
class TracedBatch {
public:
    static constexpr int most = 64;

    /// Room for one more, to be filled in; `drop_last` takes it back.
    [[nodiscard]] ShadingPoint& add(int x, int y)
    {
        Entry& entry = entries_[count_++];
        entry.x = x;
        entry.y = y;
        entry.done = false;
        return entry.point;
    }
    void drop_last() { --count_; }
    [[nodiscard]] bool full() const { return count_ == most; }
    [[nodiscard]] int count() const { return count_; }

    /// Calls write(sums, point, x, y) for every point and starts anew. Points that lie together, within
    /// the reach of their rays, share a neighbourhood.
    template <class Tracer, class Write>
    void trace(const Tracer& tracer, Neighbourhood& around, Work& work, const Write& write)
    {
        const float reach = rounded_up(tracer.reach());
        int members[most];
        for (int first = 0; first < count_; ++first) {
            if (entries_[first].done) continue;
            Bounds bounds = Bounds::nothing();
            int size = 0;
            for (int i = first; i < count_; ++i)
                if (!entries_[i].done &&
                    (extend(bounds, entries_[i].point.start, reach) || i == first)) {
                    entries_[i].done = true;
                    members[size++] = i;
                }
            if (size < few) around.whole();
            else around.collect(bounds, reach);
            for (int i = 0; i < size; ++i) {
                const Entry& entry = entries_[members[i]];
                const PointSums sums = tracer.trace(around, entry.point);
                work.rays += sums.rays;
                work.skipped_rays += sums.skipped_rays;
                write(sums, entry.point, entry.x, entry.y);
            }
        }
        count_ = 0;
    }

private:
    struct Entry {
        ShadingPoint point;
        int x, y;
        bool done;
    };
    /// Points for which collecting a neighbourhood does not pay.
    static constexpr int few = 3;

    /// Takes a point into a box, unless that gets longer than `longest`.
    [[nodiscard]] static bool extend(Bounds& bounds, const Vector3& point, float longest)
    {
        const float at[3] = {static_cast<float>(point.x), static_cast<float>(point.y),
                             static_cast<float>(point.z)};
        Bounds grown = bounds;
        for (int k = 0; k < 3; ++k) {
            grown.low[k] = (std::min)(grown.low[k], at[k]);
            grown.high[k] = (std::max)(grown.high[k], at[k]);
            if (grown.high[k] - grown.low[k] > longest) return false;
        }
        bounds = grown;
        return true;
    }

    int count_ = 0;
    Entry entries_[most];
};

}  // namespace nook::inline NOOK_TARGET::detail
