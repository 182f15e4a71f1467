#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

#include <nook/target.hpp>

namespace nook::inline NOOK_TARGET {

/// An executor over std::thread, for programs without a job system of their own. Starts
/// `workers − 1` threads (the caller's is one more worker), which sleep between calls and end with
/// the object. One call at a time; tasks must not throw. Throws std::system_error if the system
/// gives no thread.
class ThreadExecutor {
public:
    /// `workers` ≥ 1; the default is one per hardware thread.
    explicit ThreadExecutor(int workers = static_cast<int>(std::thread::hardware_concurrency()))
    {
        try_start(workers < 1 ? 1 : workers);
    }
    ThreadExecutor(const ThreadExecutor&) = delete;
    ThreadExecutor& operator=(const ThreadExecutor&) = delete;
    ~ThreadExecutor() { stop(); }

    [[nodiscard]] int concurrency() const { return static_cast<int>(threads_.size()) + 1; }

    template <class F>
    void for_each(int count, F&& f)
    {
        if (count <= 0) return;
        next_.store(0, std::memory_order_relaxed);
        {
            const std::lock_guard lock{mutex_};
            task_ = [](void* function, int task, int worker) {
                (*static_cast<std::remove_reference_t<F>*>(function))(task, worker);
            };
            function_ = const_cast<void*>(static_cast<const volatile void*>(&f));
            count_ = count;
            busy_ = static_cast<int>(threads_.size());
            ++generation_;
        }
        wake_.notify_all();
        work(0);
        std::unique_lock lock{mutex_};
        done_.wait(lock, [&] { return busy_ == 0; });
    }

private:
    // A thread that fails to start must not leave the earlier ones running: std::thread's
    // destructor would end the program.
    void try_start(int workers)
    {
        struct Guard {
            ThreadExecutor* executor;
            ~Guard()
            {
                if (executor != nullptr) executor->stop();
            }
        } guard{this};
        threads_.reserve(static_cast<std::size_t>(workers - 1));
        for (int worker = 1; worker < workers; ++worker)
            threads_.emplace_back([this, worker] { run(worker); });
        guard.executor = nullptr;
    }

    void stop()
    {
        {
            const std::lock_guard lock{mutex_};
            stopping_ = true;
        }
        wake_.notify_all();
        for (std::thread& thread : threads_) thread.join();
        threads_.clear();
    }

    void run(int worker)
    {
        std::uint64_t seen = 0;
        for (;;) {
            std::unique_lock lock{mutex_};
            wake_.wait(lock, [&] { return stopping_ || generation_ != seen; });
            if (stopping_) return;
            seen = generation_;
            lock.unlock();
            work(worker);
            lock.lock();
            if (--busy_ == 0) done_.notify_one();
        }
    }

    void work(int worker)
    {
        for (std::int64_t task; (task = next_.fetch_add(1, std::memory_order_relaxed)) < count_;)
            task_(function_, static_cast<int>(task), worker);
    }

    std::vector<std::thread> threads_;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::condition_variable done_;
    std::atomic<std::int64_t> next_{0};
    void (*task_)(void*, int, int) = nullptr;
    void* function_ = nullptr;
    int count_ = 0;
    int busy_ = 0;
    std::uint64_t generation_ = 0;
    bool stopping_ = false;
};

}  // namespace nook::inline NOOK_TARGET
