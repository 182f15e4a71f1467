#include <atomic>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include <nook/execution.hpp>
#include <nook/thread_executor.hpp>

namespace {

struct NoConcurrency {
    template <class F>
    void for_each(int, F&&)
    {}
};

// Runs `count` tasks and checks the contract of an executor.
template <nook::Executor E>
void check_contract(E& executor, int count)
{
    const auto workers = static_cast<std::size_t>(executor.concurrency());
    std::vector<std::atomic<int>> runs(static_cast<std::size_t>(count));
    std::vector<std::atomic<int>> inside(workers);
    std::atomic<int> wrong_worker{0}, shared_worker{0};
    executor.for_each(count, [&](int task, int worker) {
        if (worker < 0 || worker >= static_cast<int>(workers)) {
            ++wrong_worker;
            return;
        }
        auto& here = inside[static_cast<std::size_t>(worker)];
        if (here.fetch_add(1) != 0) ++shared_worker;
        ++runs[static_cast<std::size_t>(task)];
        if (task % 7 == 0) std::this_thread::yield();
        here.fetch_sub(1);
    });
    CHECK(wrong_worker == 0);
    CHECK(shared_worker == 0);
    int not_once = 0;
    for (const auto& run : runs) not_once += run != 1;
    CHECK(not_once == 0);
}

}  // namespace

TEST_SUITE("execution")
{
    TEST_CASE("an executor tells how many workers it has and runs tasks")
    {
        CHECK(nook::Executor<nook::Serial>);
        CHECK(nook::Executor<const nook::Serial>);
        CHECK(nook::Executor<nook::ThreadExecutor>);
        CHECK_FALSE(nook::Executor<NoConcurrency>);
        CHECK_FALSE(nook::Executor<int>);
    }

    TEST_CASE("the serial executor runs the tasks in order on the calling thread")
    {
        std::vector<int> order;
        nook::Serial{}.for_each(5, [&](int task, int worker) {
            CHECK(worker == 0);
            order.push_back(task);
        });
        CHECK(order == std::vector{0, 1, 2, 3, 4});
        nook::Serial{}.for_each(0, [](int, int) { FAIL("there is no task"); });
        nook::Serial{}.for_each(-1, [](int, int) { FAIL("there is no task"); });
        nook::Serial serial;
        check_contract(serial, 100);
    }

    TEST_CASE("the thread executor runs each task once and shares no worker index")
    {
        for (const int workers : {1, 2, 3, 8}) {
            CAPTURE(workers);
            nook::ThreadExecutor executor{workers};
            CHECK(executor.concurrency() == workers);
            for (const int count : {0, 1, 2, 7, 1000, 100000}) check_contract(executor, count);
        }
    }

    TEST_CASE("the thread executor has at least one worker")
    {
        CHECK(nook::ThreadExecutor{0}.concurrency() == 1);
        CHECK(nook::ThreadExecutor{-5}.concurrency() == 1);
        CHECK(nook::ThreadExecutor{}.concurrency() >= 1);
    }

    TEST_CASE("no tasks and a negative number of tasks return at once")
    {
        nook::ThreadExecutor executor{3};
        executor.for_each(0, [](int, int) { FAIL("there is no task"); });
        executor.for_each(-1, [](int, int) { FAIL("there is no task"); });
    }

    TEST_CASE("the thread executor is used again and again, and waits for the last task each time")
    {
        nook::ThreadExecutor executor{4};
        int late = 0;
        for (int round = 0; round < 2000; ++round) {
            std::atomic<int> done{0};
            executor.for_each(5, [&](int, int) { ++done; });
            late += done != 5;
        }
        CHECK(late == 0);
    }

    TEST_CASE("the threads work side by side")
    {
        // Each of two tasks waits for the other: one thread alone would never end.
        nook::ThreadExecutor executor{2};
        std::atomic<int> arrived{0};
        executor.for_each(2, [&](int, int) {
            ++arrived;
            while (arrived < 2) std::this_thread::yield();
        });
        CHECK(arrived == 2);
    }

    TEST_CASE("what the tasks wrote is visible after the call, without atomics")
    {
        nook::ThreadExecutor executor{4};
        std::vector<int> values(10000);
        executor.for_each(10000,
                          [&](int task, int) { values[static_cast<std::size_t>(task)] = task; });
        int wrong = 0;
        for (int i = 0; i < 10000; ++i) wrong += values[static_cast<std::size_t>(i)] != i;
        CHECK(wrong == 0);
    }

    TEST_CASE("a constant function object and an lvalue one are taken as they are")
    {
        nook::ThreadExecutor executor{2};
        std::atomic<int> sum{0};
        const auto add = [&](int task, int) { sum += task; };
        executor.for_each(10, add);
        CHECK(sum == 45);
    }
}
