// SPDX-License-Identifier: Apache-2.0
#include "farm/process.h"

#include "base/file_descriptor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>

namespace velatura::farm {

namespace {

/// In the child, between fork and exec: only calls that a signal handler may make.
[[noreturn]] void start(char* const* arguments, const char* directory, int output) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    sigset_t none;
    ::sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    for (const int signal : {SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGHUP, SIGXFSZ})
        ::signal(signal, SIG_DFL);
    ::dup2(output, STDOUT_FILENO);
    ::dup2(output, STDERR_FILENO);
    const auto fail = [](const char* what, const char* name) {
        for (const char* text : {"error: ", what, name, " [farm-process]\n"})
            if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) break;
        ::_exit(127);
    };
    if (directory[0] != 0 && ::chdir(directory) != 0) fail("cannot enter ", directory);
    ::execvp(arguments[0], arguments);
    fail("cannot start ", arguments[0]);
    ::_exit(127);
}

/// Hands on what a process prints, line by line.
class Lines {
  public:
    explicit Lines(const ProcessRequest& request) : request_(request) {}

    void add(std::string_view bytes) {
        rest_ += bytes;
        size_t begin = 0;
        for (size_t end; (end = rest_.find('\n', begin)) != std::string::npos; begin = end + 1)
            hand_on(std::string_view(rest_).substr(begin, end - begin));
        rest_.erase(0, begin);
    }

    void finish() {
        if (!rest_.empty()) hand_on(rest_);
        rest_.clear();
    }

  private:
    void hand_on(std::string_view line) const {
        if (request_.on_line) request_.on_line(line);
    }

    const ProcessRequest& request_;
    std::string rest_;
};

bool has_ended(pid_t process) {
    siginfo_t info{};
    return ::waitid(P_PID, id_t(process), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == process;
}

double seconds(const timeval& t) {
    return double(t.tv_sec) + double(t.tv_usec) * 1e-6;
}

Error failed(const std::string& what) {
    return {"farm-process", fmt::format("{}: {}", what, std::strerror(errno))};
}

}  // namespace

Result<ProcessResult> run_process(const ProcessRequest& request) {
    std::vector<std::string> words = request.arguments;
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);

    FileDescriptor log;
    if (!request.log.empty()) {
        log = FileDescriptor(
            ::open(request.log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
        if (log.get() < 0) return failed("cannot write " + request.log);
    }
    std::array<int, 2> pipe{};
    if (::pipe2(pipe.data(), O_CLOEXEC) != 0) return failed("cannot make a pipe");
    const FileDescriptor from_child(pipe[0]);
    FileDescriptor to_parent(pipe[1]);

    const auto begin = std::chrono::steady_clock::now();
    const pid_t process = ::fork();
    if (process < 0) return failed("cannot start a process");
    if (process == 0) start(arguments.data(), request.directory.c_str(), to_parent.get());
    to_parent = FileDescriptor();
    if (request.on_start) request.on_start(process);

    Lines lines(request);
    std::array<char, 16384> buffer{};
    for (bool is_stopped = false;;) {
        pollfd ready = {from_child.get(), POLLIN, 0};
        const int found = ::poll(&ready, 1, 100);
        if (!is_stopped && request.is_to_stop && request.is_to_stop()) {
            is_stopped = true;
            ::kill(process, SIGTERM);
        }
        if (found == 0 && has_ended(process)) break;  // what it started can hold the pipe
        if (found <= 0) continue;
        const ssize_t count = ::read(from_child.get(), buffer.data(), buffer.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) break;
        const std::string_view bytes(buffer.data(), size_t(count));
        // A log that is not complete is no reason to end a render
        if (log.get() >= 0 && ::write(log.get(), bytes.data(), bytes.size()) < 0) log = {};
        lines.add(bytes);
    }
    lines.finish();

    int status = 0;
    rusage used{};
    while (::wait4(process, &status, 0, &used) < 0)
        if (errno != EINTR) return failed("lost a process");
    ProcessResult result;
    result.is_killed = WIFSIGNALED(status);
    result.code = result.is_killed ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
    result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    result.cpu_s = seconds(used.ru_utime) + seconds(used.ru_stime);
    result.peak_bytes = uint64_t(used.ru_maxrss) * 1024;
    return result;
}

std::string host_name() {
    std::array<char, 256> name{};
    if (::gethostname(name.data(), name.size() - 1) != 0) return "unknown";
    return name.data();
}

std::string own_program() {
    std::error_code error;
    const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
    return error ? std::string() : self.string();
}

std::string compositor_program() {
    const auto beside = std::filesystem::path(own_program()).parent_path() / "velatura-comp";
    std::error_code error;
    return std::filesystem::exists(beside, error) ? beside.string() : "velatura-comp";
}

}  // namespace velatura::farm
