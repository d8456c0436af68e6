// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/task_queue.h"

#include <algorithm>
#include <functional>

namespace velatura::usd::compose {

void TaskQueue::add(Task task, int node) {
    std::vector<int>& queue = nodes_[size_t(task)];
    const bool is_implied = task == Task::ImpliedClasses || task == Task::ImpliedSpecializes;
    if (is_implied && std::find(queue.begin(), queue.end(), node) != queue.end()) return;
    queue.push_back(node);
    // Lower numbers first; of implied classes those furthest from the root
    if (task == Task::ImpliedClasses) {
        std::push_heap(queue.begin(), queue.end(), std::less<>());
    } else {
        std::push_heap(queue.begin(), queue.end(), std::greater<>());
    }
}

int TaskQueue::pop(Task task) {
    std::vector<int>& queue = nodes_[size_t(task)];
    if (task == Task::ImpliedClasses) {
        std::pop_heap(queue.begin(), queue.end(), std::less<>());
    } else {
        std::pop_heap(queue.begin(), queue.end(), std::greater<>());
    }
    const int node = queue.back();
    queue.pop_back();
    return node;
}

}  // namespace velatura::usd::compose
