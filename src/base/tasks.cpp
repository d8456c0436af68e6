// SPDX-License-Identifier: Apache-2.0
#include "base/tasks.h"

#include "base/thread_scope.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <memory>
#include <thread>

namespace velatura {

namespace {

// The arena holds the asked number of slots even on a machine with fewer cores, so that --threads 7
// runs 7 threads.
tbb::task_arena*& arena_of_process() {
    static tbb::task_arena* arena = nullptr;
    return arena;
}

/// Of a ThreadScope; threads that help it work in its arena already.
thread_local tbb::task_arena* arena_of_thread = nullptr;

tbb::task_arena* current_arena() {
    return arena_of_thread ? arena_of_thread : arena_of_process();
}

int core_count() {
    return std::max(1, int(std::thread::hardware_concurrency()));
}

struct Control {
    tbb::global_control limit;
    tbb::task_arena arena;
    tbb::task_arena* outer;

    explicit Control(int threads)
        : limit(tbb::global_control::max_allowed_parallelism, size_t(threads)),
          arena(threads),
          outer(arena_of_process()) {}
};

/// The limit of the process only where it would be too low for the arena.
struct ScopeControl {
    std::unique_ptr<tbb::global_control> raised;
    tbb::task_arena arena;
    tbb::task_arena* outer;

    explicit ScopeControl(int threads) : arena(threads), outer(arena_of_thread) {
        if (threads > core_count())
            raised = std::make_unique<tbb::global_control>(
                tbb::global_control::max_allowed_parallelism, size_t(threads));
    }
};

}  // namespace

ThreadLimit::ThreadLimit(int threads) {
    auto* control = new Control(threads > 0 ? threads : core_count());
    arena_of_process() = &control->arena;
    control_ = control;
}

ThreadLimit::~ThreadLimit() {
    auto* control = static_cast<Control*>(control_);
    arena_of_process() = control->outer;
    // oneTBB may take memory to give up an arena, and its destructors must not throw: where an
    // exception is on its way, there may be no memory, and the process is about to end
    if (std::uncaught_exceptions() == 0) delete control;
}

ThreadScope::ThreadScope(int threads) {
    auto* control = new ScopeControl(threads > 0 ? threads : core_count());
    arena_of_thread = &control->arena;
    control_ = control;
}

ThreadScope::~ThreadScope() {
    auto* control = static_cast<ScopeControl*>(control_);
    arena_of_thread = control->outer;
    delete control;
}

int thread_count() {
    return current_arena() ? current_arena()->max_concurrency()
                           : tbb::this_task_arena::max_concurrency();
}

void start_threads() {
    // Each body waits for the others, and so takes a thread of its own; not for long where threads
    // are busy elsewhere
    const auto count = size_t(thread_count());
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::milliseconds(100);
    std::atomic<size_t> started = 0;
    parallel_for(count, [&](size_t) {
        ++started;
        while (started < count && std::chrono::steady_clock::now() < deadline)
            std::this_thread::yield();
    });
}

void parallel_for(size_t count, const std::function<void(size_t)>& body, size_t grain) {
    const auto run = [&] {
        tbb::parallel_for(tbb::blocked_range<size_t>(0, count, grain > 0 ? grain : 1),
                          [&](const tbb::blocked_range<size_t>& range) {
                              for (size_t i = range.begin(); i != range.end(); ++i) body(i);
                          });
    };
    if (current_arena()) {
        current_arena()->execute(run);
    } else {
        run();
    }
}

void parallel_for_isolated(size_t count, const std::function<void(size_t)>& body) {
    const auto run = [&] {
        tbb::this_task_arena::isolate([&] { tbb::parallel_for(size_t(0), count, body); });
    };
    if (current_arena()) {
        current_arena()->execute(run);
    } else {
        run();
    }
}

}  // namespace velatura
