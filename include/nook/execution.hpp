#pragma once

#include <concepts>

#include <nook/target.hpp>

namespace nook {

/// How the tasks of a kernel reach threads. nook starts none: the caller's job system is an object
/// with
///   - `int concurrency()`: how many workers may run at once, ≥ 1;
///   - `void for_each(int count, F f)`: runs f(task, worker) once for each task in [0, count), on
///     any threads and in any order, and returns when all are done. `worker` lies in
///     [0, concurrency()), and no two calls that run at the same time share one.
/// A kernel cuts its work by the image alone, so the bits do not depend on the executor.
template <class E>
concept Executor = requires(E& executor, void (*task)(int, int))
{
    {
        executor.concurrency()
        } -> std::convertible_to<int>;
    executor.for_each(1, task);
};

/// Runs every task on the calling thread. The default.
struct Serial {
    [[nodiscard]] NOOK_INLINE static constexpr int concurrency() { return 1; }

    template <class F>
    NOOK_INLINE void for_each(int count, F&& f) const
    {
        for (int task = 0; task < count; ++task) f(task, 0);
    }
};

}  // namespace nook
