#pragma once

#include <type_traits>

#include <nook/target.hpp>

namespace compare {

/// Threads that another translation unit owns; by default there is none but the caller's.
struct Threads {
    int workers = 1;
    void* executor = nullptr;
    void (*for_each)(void* executor, int count, void* context,
                     void (*task)(void* context, int task, int worker)) = nullptr;
};

}  // namespace compare

namespace compare::inline NOOK_TARGET {

/// Lends an executor of nook to kernels of another translation unit.
template <class E>
[[nodiscard]] Threads lend(E& executor)
{
    return {executor.concurrency(), &executor,
            [](void* lent, int count, void* context, void (*task)(void*, int, int)) {
                static_cast<E*>(lent)->for_each(
                    count, [&](int index, int worker) { task(context, index, worker); });
            }};
}

/// What was lent, as an executor of nook again.
struct Borrowed {
    const Threads& threads;

    [[nodiscard]] int concurrency() const { return threads.workers; }

    template <class F>
    void for_each(int count, F&& f) const
    {
        if (threads.for_each == nullptr) {
            for (int task = 0; task < count; ++task) f(task, 0);
            return;
        }
        using Function = std::remove_reference_t<F>;
        threads.for_each(threads.executor, count, &f, [](void* context, int task, int worker) {
            (*static_cast<Function*>(context))(task, worker);
        });
    }
};

}  // namespace compare::inline NOOK_TARGET
