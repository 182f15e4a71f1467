#pragma once

#include <cstddef>

#include <nook/checks.hpp>
#include <nook/outcome.hpp>
#include <nook/scratch.hpp>

/// How a kernel lends scratch to the workers of an executor and adds up what they did.
namespace nook::inline NOOK_TARGET::detail {

/// How many pieces of a size > 0 cover a whole ≥ 0.
[[nodiscard]] constexpr int pieces(int whole, int size)
{
    return whole / size + (whole % size != 0 ? 1 : 0);
}

/// For kernels that need nothing but their counts.
struct NoMemory {
    constexpr int operator()(ScratchLayout&, std::size_t) const { return 0; }
};

/// Bytes of scratch that `run_tasks` asks for with this layout.
template <class Layout>
[[nodiscard]] std::size_t task_scratch_size(const Layout& layout, int workers)
{
    ScratchLayout block;
    static_cast<void>(block.take<Work>(static_cast<std::size_t>(workers)));
    static_cast<void>(layout(block, static_cast<std::size_t>(workers)));
    return block.size();
}

/// Runs first(memory, task) for each task in [0, first_count), and when all are done
/// body(work, memory, task, worker) for each task in [0, count). `layout(block, workers)` takes the
/// memory of all workers out of a ScratchLayout; `work` belongs to the worker. Returns the sum of the
/// workers' counts, or an error when there is no scratch; then no task has run.
template <class Layout, class First, class Body, class S, class E>
Outcome run_tasks(const Layout& layout, const First& first, int first_count, const Body& body,
                  int count, S&& scratch, E&& executor)
{
    const int workers = static_cast<int>(executor.concurrency());
    const std::size_t size = task_scratch_size(layout, workers);
    void* const data = scratch.reserve(size);
    if (data == nullptr) return {check_scratch<S>(size)};
    ScratchLayout block{data};
    Work* const work = block.take<Work>(static_cast<std::size_t>(workers));
    for (int worker = 0; worker < workers; ++worker) work[worker] = {};
    const auto memory = layout(block, static_cast<std::size_t>(workers));
    if (first_count > 0)
        executor.for_each(first_count, [&](int task, int) { first(memory, task); });
    executor.for_each(count,
                      [&](int task, int worker) { body(work[worker], memory, task, worker); });
    Outcome outcome{};
    for (int worker = 0; worker < workers; ++worker) outcome.work += work[worker];
    return outcome;
}

/// Runs body(work, memory, task, worker) for each task in [0, count), as above.
template <class Layout, class Body, class S, class E>
Outcome run_tasks(int count, const Layout& layout, const Body& body, S&& scratch, E&& executor)
{
    const auto nothing = [](const auto&, int) {};
    return run_tasks(layout, nothing, 0, body, count, scratch, executor);
}

}  // namespace nook::inline NOOK_TARGET::detail
