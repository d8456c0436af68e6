// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/layer_stack.h"

#include <iostream>

int main(int argc, char** argv) {
    const auto stack = velatura::compositor::LayerStack::load(argc > 1 ? argv[1] : "");
    if (!stack) {
        std::cerr << stack.error().message << "\n";
        return 1;
    }
    for (const std::string& bounce : stack->column_names()) std::cout << bounce << "\n";
    for (const std::string& group : stack->group_names()) std::cout << "C_" << group << "\n";
}
