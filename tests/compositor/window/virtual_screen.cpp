// SPDX-License-Identifier: Apache-2.0
#include "virtual_screen.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <sstream>

namespace velatura::compositor::window {

namespace {

std::string find_program(const std::string& name) {
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');) {
        const std::string program = folder + "/" + name;
        if (access(program.c_str(), X_OK) == 0) return program;
    }
    return {};
}

void end(pid_t server) {
    kill(server, SIGTERM);
    waitpid(server, nullptr, 0);
}

/// The number that the server writes once it listens.
std::string read_line(int from) {
    constexpr int longest_start_ms = 20'000;
    std::string line;
    pollfd waiting{from, POLLIN, 0};
    while (line.empty() || line.back() != '\n') {
        char c = 0;
        if (poll(&waiting, 1, longest_start_ms) <= 0 || read(from, &c, 1) != 1) return {};
        line += c;
    }
    line.pop_back();
    return line;
}

}  // namespace

bool VirtualScreen::is_installed() {
    return !find_program("Xvfb").empty();
}

std::unique_ptr<VirtualScreen> VirtualScreen::start(int width, int height) {
    const std::string program = find_program("Xvfb");
    std::array<int, 2> ends{};
    if (program.empty() || pipe(ends.data()) != 0) return nullptr;
    const std::string size = std::to_string(width) + "x" + std::to_string(height) + "x24";
    const std::string fd = std::to_string(ends[1]);
    const pid_t server = fork();
    if (server == 0) {
        close(ends[0]);
        const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
        dup2(nowhere, STDOUT_FILENO);
        dup2(nowhere, STDERR_FILENO);
        // It finds a free number itself, so that tests may run side by side
        execl(program.c_str(), program.c_str(), "-displayfd", fd.c_str(), "-screen", "0",
              size.c_str(), "-nolisten", "tcp", nullptr);
        _exit(127);
    }
    close(ends[1]);
    const std::string number = server > 0 ? read_line(ends[0]) : std::string();
    close(ends[0]);
    if (!number.empty())
        return std::unique_ptr<VirtualScreen>(new VirtualScreen(server, ":" + number));
    if (server > 0) end(server);
    return nullptr;
}

VirtualScreen::~VirtualScreen() {
    end(server_);
}

}  // namespace velatura::compositor::window
