#pragma once

#include <algorithm>
#include <cstdint>

#include <nook/outcome.hpp>
#include <nook/scene/neighbourhood.hpp>
#include <nook/scene/tangent_planes.hpp>
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
    /// the reach of their rays, and look the same way share a neighbourhood.
    template <class Tracer, class Write>
    void trace(const Tracer& tracer, Neighbourhood& around, Work& work, const Write& write)
    {
        for_each_point(tracer, around, [&](const ShadingPoint& point, int x, int y) {
            const PointSums sums = tracer.trace(around, point);
            work.rays += sums.rays;
            work.skipped_rays += sums.skipped_rays;
            write(sums, point, x, y);
        });
    }
    /// Calls f(point, x, y) for every point, with its neighbourhood around it, and starts anew.
    template <class Tracer, class F>
    void for_each_point(const Tracer& tracer, Neighbourhood& around, const F& f)
    {
        TangentPlanes planes{rounded_up(tracer.reach())};
        int members[most];
        bool alike = true;
        for (int first = 0; first < count_; ++first) {
            if (entries_[first].done) continue;
            const int size = gather(planes, first, members, alike);
            if (size < few) {
                around.whole();
            } else {
                planes.close();
                around.collect(planes);
            }
            for (int i = 0; i < size; ++i) {
                const Entry& entry = entries_[members[i]];
                f(entry.point, entry.x, entry.y);
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
    /// Takes the points that lie close to the first, and with `alike` look the same way. Where these are
    /// few it takes all that lie close, from then on.
    [[nodiscard]] int gather(TangentPlanes& planes, int first, int (&members)[most], bool& alike)
    {
        for (;; alike = false) {
            planes.start(entries_[first].point.start, entries_[first].point.surface);
            int size = 0;
            bool others = false;
            for (int i = first; i < count_; ++i) {
                if (entries_[i].done) continue;
                const ShadingPoint& point = entries_[i].point;
                if (i != first && alike && !planes.is_alike(point.surface)) {
                    others = true;
                    continue;
                }
                if (i != first && !planes.is_close(point.start)) continue;
                members[size++] = i;
                planes.add(point.start, point.normal, point.surface, point.slack);
            }
            if (alike && others && size < many) continue;
            for (int i = 0; i < size; ++i) entries_[members[i]].done = true;
            return size;
        }
    }

    /// Points that are worth a neighbourhood of their own.
    static constexpr int many = 12;
    /// Points for which collecting a neighbourhood does not pay.
    static constexpr int few = 3;

    int count_ = 0;
    Entry entries_[most];
};

}  // namespace nook::inline NOOK_TARGET::detail
