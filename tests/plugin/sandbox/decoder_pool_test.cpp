// SPDX-License-Identifier: Apache-2.0
// Images that decoder processes read: what a decoder does to itself costs its image and nothing
// else.
#include "plugins/openimageio/sandbox/decoder_pool.h"

#include "base/process/process_limits.h"
#include "double_images.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <regex>
#include <set>
#include <thread>

namespace velatura::plugins::openimageio::testing {
namespace {

using Clock = std::chrono::steady_clock;
using Image = std::unique_ptr<SourceImage>;

constexpr int width = DoubleImages::width, height = DoubleImages::height,
              channels = DoubleImages::channels;

PoolOptions options(size_t decoders = 1, DecoderProcessLimits limits = {}) {
    return {.program = VELATURA_DOUBLE_PROGRAM, .max_decoders = decoders, .limits = limits};
}

/// A program that ends at once, or does what it is not asked to.
PoolOptions other_program(const std::string& program) {
    PoolOptions other = options();
    other.program = program;
    return other;
}

Image open(DecoderPool& pool, const std::string& asset) {
    Result<Image> opened = pool.open(asset, ImageUse::Texture);
    EXPECT_TRUE(opened) << asset << ": " << opened.error().message;
    return opened ? std::move(*opened) : nullptr;
}

Result<void> read(SourceImage& image, std::vector<float>& values, int y, int y_end) {
    values.assign(size_t(y_end - y) * width * channels, -1.0f);
    return image.read_lines(0, y, y_end, channels, values);
}

/// Why these lines cannot be read.
std::string failure(SourceImage& image, int y = 0, int y_end = 64) {
    std::vector<float> values;
    const Result<void> done = read(image, values, y, y_end);
    return done ? "" : done.error().message;
}

void expect_right(SourceImage& image, const std::string& asset, int y = 0, int y_end = 64) {
    std::vector<float> values;
    const Result<void> done = read(image, values, y, y_end);
    ASSERT_TRUE(done) << asset << ": " << done.error().message;
    ASSERT_EQ(values, DoubleImages::lines(asset, y, y_end)) << asset;
}

std::string text_of(const std::string& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// What follows the name of "number (name) state parent": what a process is called may have
/// anything in it.
std::string state_of(const std::string& process) {
    const std::string stat = text_of("/proc/" + process + "/stat");
    const size_t name_end = stat.rfind(')');
    return name_end == std::string::npos ? "" : stat.substr(name_end + 2);
}

/// Not one that only waits for its parent to ask how it ended.
bool runs(pid_t process) {
    const std::string state = state_of(std::to_string(process));
    return !state.empty() && state[0] != 'Z';
}

/// Within five seconds.
bool ends(pid_t process) {
    for (int i = 0; i < 500 && runs(process); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return !runs(process);
}

/// Lines of its status: whether it may get new ones, and by which filter its calls go.
std::string rights_of(const std::string& process) {
    const std::string status = text_of("/proc/" + process + "/status");
    const size_t begin = status.find("NoNewPrivs:");
    return status.substr(begin, status.find("Speculation", begin) - begin);
}

size_t open_files() {
    const std::filesystem::directory_iterator files("/proc/self/fd");
    return size_t(std::distance(begin(files), end(files)));
}

/// Processes whose parent is one of these, with those that are zombies.
std::set<pid_t> children_of(const std::set<pid_t>& parents) {
    std::set<pid_t> children;
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
        const std::string number = entry.path().filename();
        if (number.find_first_not_of("0123456789") != std::string::npos) continue;
        const std::string state = state_of(number);
        if (!state.empty() && parents.contains(std::stoi(state.substr(2))))
            children.insert(std::stoi(number));
    }
    return children;
}

TEST(DecoderPool, BringsWhatItsSourceHas) {
    DecoderPool pool(options());
    const Image image = open(pool, "plain");
    ASSERT_TRUE(image);
    EXPECT_EQ(image->spec().levels.size(), 2u);
    EXPECT_EQ(image->spec().levels[0].height, height);
    EXPECT_EQ(image->spec().levels[1].tile_width, DoubleImages::tile);
    expect_right(*image, "plain", 5, 6);
    // Larger than what is usually shared
    expect_right(*image, "plain", 0, height);
    expect_right(*image, "plain", 17, 64);
    constexpr int tile = DoubleImages::tile;
    std::vector<float> values(size_t(tile * tile) * 2);
    ASSERT_TRUE(image->read_tile(1, 32, 48, 2, values));
    for (int i = 0; i < tile * tile; ++i)
        for (int c = 0; c < 2; ++c)
            ASSERT_EQ(values[size_t(i * 2 + c)],
                      DoubleImages::value("plain", 32 + i % tile, 48 + i / tile, c));
}

/// Until nothing is left, the smallest of blocks neither.
void take_all_memory(std::vector<std::unique_ptr<char[]>>& taken) {
    taken.reserve(1'000'000);
    // Of 0 the kernel takes the other limit
    const rlimit none{.rlim_cur = 1, .rlim_max = RLIM_INFINITY};
    ASSERT_EQ(setrlimit(RLIMIT_DATA, &none), 0);
    for (size_t bytes = size_t(1) << 20; bytes > 0; bytes /= 2) {
        while (char* const block = new (std::nothrow) char[bytes]) taken.emplace_back(block);
    }
}

TEST(DecoderPool, ClosesWithoutMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "sanitizers take memory by ways of their own";
#endif
    EXPECT_EXIT(
        {
            DecoderPool pool(options());
            Image image = open(pool, "plain");
            std::vector<std::unique_ptr<char[]>> taken;
            const pid_t decoder = pool.processes().back();
            take_all_memory(taken);
            // As the kernel would: then there is something to say, and no memory for it
            kill(decoder, SIGKILL);
            image.reset();
            taken.clear();
            _exit(image ? 1 : 0);
        },
        ::testing::ExitedWithCode(0), "");
}

TEST(DecoderPool, SaysWhatItsSourceSays) {
    DecoderPool pool(options());
    const Result<Image> missing = pool.open("missing.png", ImageUse::Texture);
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().message, "there is no missing.png");
    EXPECT_EQ(failure(*open(pool, "refused")), "this one never");
    EXPECT_EQ(failure(*open(pool, "throw")), "thrown [31m by a decoder");
    EXPECT_FALSE(pool.open(std::string(100000, 'x'), ImageUse::Texture));
    expect_right(*open(pool, "plain"), "plain");
}

/// By a signal or an exit, while it is opened or read; the other image of that decoder notices
/// nothing.
TEST(DecoderPool, ACrashCostsItsImageOnly) {
    DecoderPool pool(options());
    const Image other = open(pool, "plain/other");
    for (const auto& [what, why] :
         {std::pair("segv", fmt::format("was ended by signal {}", SIGSEGV)),
          std::pair("kill", fmt::format("was ended by signal {}", SIGKILL)),
          std::pair("abort", fmt::format("was ended by signal {}", SIGABRT)),
          std::pair("exit", std::string("ended with code 7"))}) {
        expect_right(*other, "plain/other");
        const Image bad = open(pool, what);
        EXPECT_EQ(failure(*bad), "the decoder process " + why);
        expect_right(*other, "plain/other", 100, 200);
        const Result<Image> never = pool.open(std::string(what) + ":open", ImageUse::Texture);
        ASSERT_FALSE(never);
        EXPECT_EQ(never.error().message, "the decoder process " + why);
        expect_right(*other, "plain/other", 50, 60);
    }
}

TEST(DecoderPool, WhatEndedADecoderIsNotTriedAgain) {
    DecoderPool pool(options());
    const Image bad = open(pool, "segv"), other = open(pool, "plain");
    const std::string why = failure(*bad);
    expect_right(*other, "plain");
    const std::vector<pid_t> before = pool.processes();
    for (int i = 0; i < 10; ++i) EXPECT_EQ(failure(*bad), why);
    EXPECT_EQ(pool.open("segv", ImageUse::Image).error().message, why);
    expect_right(*other, "plain");
    EXPECT_EQ(pool.processes(), before);
}

/// The decoder dies of what another image did to it: the one that was asked for is tried again,
/// alone.
TEST(DecoderPool, TheCrashOfANeighborIsNotOnesOwn) {
    DecoderPool pool(options());
    const Image poison = open(pool, "poison"), other = open(pool, "plain");
    EXPECT_EQ(failure(*poison), "");
    expect_right(*other, "plain");
    expect_right(*other, "plain", 64, 128);
}

TEST(DecoderPool, AStoppedDecoderIsNotWaitedForForEver) {
    DecoderPool pool(options(1, {.wall_seconds = 1}));
    const Image other = open(pool, "plain"), stopped = open(pool, "stop");
    const Clock::time_point begin = Clock::now();
    EXPECT_EQ(failure(*stopped), "decoding took more than 1 s; raise --limit decode-time");
    EXPECT_LT(Clock::now() - begin, std::chrono::seconds(5));
    expect_right(*other, "plain");
}

TEST(DecoderPool, ADecoderThatComputesForEverIsEnded) {
    DecoderPool pool(options(1, {.cpu_seconds = 0.5}));
    const Image other = open(pool, "plain"), spinning = open(pool, "spin");
    EXPECT_EQ(failure(*spinning), "decoding took more than 0.5 s; raise --limit decode-time");
    expect_right(*other, "plain");
}

/// Not for all that it reads in hours.
TEST(DecoderPool, TimeIsCountedForEachRequest) {
    DecoderPool pool(options(1, {.cpu_seconds = 0.6}));
    const Image busy = open(pool, "busy");
    const std::vector<pid_t> before = pool.processes();
    for (int i = 0; i < 5; ++i) expect_right(*busy, "busy", i, i + 2);
    EXPECT_EQ(pool.processes(), before);
}

TEST(DecoderPool, ADecoderThatTakesAllMemoryIsEnded) {
    if (!limits_addresses) GTEST_SKIP() << "sanitizers need all addresses";
    DecoderPool pool(options(1, {.address_bytes = size_t(512) << 20}));
    const Image other = open(pool, "plain"), greedy = open(pool, "memory");
    EXPECT_EQ(failure(*greedy), "the decoder process ran out of memory");
    expect_right(*other, "plain");
}

TEST(DecoderPool, WhatMakesNoSenseEndsTheDecoder) {
    DecoderPool pool(options());
    const Image other = open(pool, "plain"), liar = open(pool, "liar");
    EXPECT_EQ(failure(*liar),
              "what the decoder process answers makes no sense: it answers another request");
    expect_right(*other, "plain");
}

/// Of all memory limits, files and rights a decoder has what reading takes.
TEST(DecoderPool, DecodersHaveNoRightsTheyDoNotNeed) {
    const std::string own_rights = rights_of("self");
    DecoderPool pool(options(1, {.address_bytes = size_t(1) << 30}));
    const Image image = open(pool, "plain");
    const std::vector<pid_t> processes = pool.processes();
    ASSERT_EQ(processes.size(), 2u);
    const std::string folder = fmt::format("/proc/{}/", processes[1]);
    const std::string limits = text_of(folder + "limits");
    EXPECT_NE(limits.find("Max core file size        0 "), std::string::npos) << limits;
    EXPECT_NE(limits.find("Max file size             0 "), std::string::npos) << limits;
    if (limits_addresses) {
        EXPECT_EQ(limits.find("Max address space         unlimited"), std::string::npos);
    }
    EXPECT_TRUE(rights_of(std::to_string(processes[1])).starts_with("NoNewPrivs:\t1"));
    EXPECT_EQ(text_of(folder + "oom_score_adj"), "1000\n");
    EXPECT_EQ(rights_of("self"), own_rights);
}

/// Also those that a library has opened without a thought of programs that are started.
TEST(DecoderPool, DecodersHaveNoFilesOfTheRenderer) {
    const FileDescriptor low(::open("/proc/self/status", O_RDONLY)),
        file(::fcntl(low.get(), F_DUPFD, 20));
    DecoderPool pool(options());
    const Image image = open(pool, "plain");
    std::vector<std::string> found;
    const std::string folder = fmt::format("/proc/{}/fd", pool.processes().at(0));
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        found.push_back(std::regex_replace(std::filesystem::read_symlink(entry.path()).string(),
                                           std::regex("\\[.*"), ""));
    std::sort(found.begin(), found.end());
    const std::vector<std::string> expected = {"/dev/null", "/dev/null", "/dev/null", "socket:"};
    EXPECT_EQ(found, expected);
}

/// Nor do they start processes, speak to others, or take limits back.
TEST(DecoderPool, DecodersCanDoNothingButRead) {
    DecoderPool pool(options());
    const std::string file = "/dev/shm/velatura_double";
    std::filesystem::remove(file);
    const Image plain = open(pool, "plain");
    if (rights_of(std::to_string(pool.processes().at(1))).find("Seccomp:\t2") == std::string::npos)
        GTEST_SKIP() << "the system has no filter of calls";
    for (const std::string what : {"write", "socket", "fork", "signal", "limit", "remove"}) {
        const Image image = open(pool, what);
        EXPECT_EQ(failure(*image), "") << what;
        expect_right(*image, what);
    }
    EXPECT_FALSE(std::filesystem::exists(file));
    expect_right(*open(pool, "thread"), "thread");
}

/// Who asks a whole group or job to end means the renderer, which may have to read on for what it
/// writes.
TEST(DecoderPool, SignalsThatAskToEndAreTheRenderersAffair) {
    DecoderPool pool(options());
    const Image image = open(pool, "plain");
    const std::vector<pid_t> before = pool.processes();
    for (const pid_t process : before) {
        EXPECT_NE(::getpgid(process), ::getpgid(0));
        for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGTSTP})
            ::kill(process, signal);
    }
    expect_right(*image, "plain");
    EXPECT_EQ(pool.processes(), before);
}

/// By the kernel, say, when memory is short: no image has done it.
TEST(DecoderPool, ADecoderThatIsKilledBetweenReadsIsReplaced) {
    DecoderPool pool(options());
    const Image image = open(pool, "plain");
    for (int i = 0; i < 5; ++i) {
        expect_right(*image, "plain", i, i + 3);
        ::kill(pool.processes().at(1), SIGKILL);
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    expect_right(*image, "plain");
}

TEST(DecoderPool, AForkServerThatIsKilledIsReplaced) {
    DecoderPool pool(options(2));
    const Image image = open(pool, "plain"), second = open(pool, "plain/2");
    const std::vector<pid_t> before = pool.processes();
    ASSERT_EQ(before.size(), 3u);
    ::kill(before[0], SIGKILL);
    EXPECT_TRUE(ends(before[1]));
    expect_right(*image, "plain");
    expect_right(*second, "plain/2");
    EXPECT_NE(pool.processes().at(0), before[0]);
    EXPECT_FALSE(children_of({::getpid()}).contains(before[0])) << "nobody has waited for it";
}

TEST(DecoderPool, AFileThatIsAnotherOneByNowIsRefused) {
    DecoderPool pool(options());
    const Image image = open(pool, "other");
    EXPECT_EQ(failure(*image), "");
    ::kill(pool.processes().at(1), SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_EQ(failure(*image), "the file has changed since it was opened");
}

TEST(DecoderPool, HasAtMostAsManyDecodersAsItMay) {
    DecoderPool pool(options(3));
    std::vector<Image> images;
    for (int i = 0; i < 8; ++i) images.push_back(open(pool, fmt::format("plain/{}", i)));
    EXPECT_EQ(pool.processes().size(), 1u + 3u);
    for (int i = 0; i < 8; ++i) expect_right(*images[size_t(i)], fmt::format("plain/{}", i));
}

TEST(DecoderPool, ThreadsReadAtTheSameTime) {
    DecoderPool pool(options(4));
    std::vector<std::thread> threads;
    for (int i = 0; i < 8; ++i)
        threads.emplace_back([&pool, i] {
            const std::string asset = fmt::format("plain/{}", i);
            const Image image = open(pool, asset);
            for (int y = 0; y < 1000; y += 100) expect_right(*image, asset, y, y + 100);
            EXPECT_NE(failure(*open(pool, fmt::format("segv/{}", i))), "");
            expect_right(*image, asset);
        });
    for (std::thread& thread : threads) thread.join();
}

TEST(DecoderPool, LeavesNothingBehind) {
    const size_t files = open_files();
    std::set<pid_t> ours;
    {
        DecoderPool pool(options(2));
        (void)open(pool, "plain");
        const size_t files_of_one = open_files();
        const pid_t fork_server = pool.processes().at(0);
        for (int i = 0; i < 200; ++i) {
            const Image image = open(pool, fmt::format("plain/{}", i));
            expect_right(*image, fmt::format("plain/{}", i), 0, 2);
            if (i % 10 != 0) continue;
            EXPECT_NE(failure(*open(pool, fmt::format("segv/{}", i))), "");
        }
        EXPECT_LE(open_files(), files_of_one + 2);
        // With zombies, if there were any
        EXPECT_LE(children_of({fork_server}).size(), 2u);
        for (const pid_t process : pool.processes()) ours.insert(process);
    }
    EXPECT_EQ(open_files(), files);
    for (const pid_t process : ours) EXPECT_TRUE(ends(process)) << process;
    EXPECT_TRUE(children_of({::getpid()}).empty());
}

TEST(DecoderPool, EndsWithARendererThatIsKilled) {
    std::array<int, 2> ends_of_pipe = {};
    ASSERT_EQ(::pipe(ends_of_pipe.data()), 0);
    const pid_t renderer = ::fork();
    if (renderer == 0) {
        DecoderPool pool(options(2));
        const Image one = open(pool, "plain"), stopped = open(pool, "stop");
        std::thread([&] { (void)failure(*stopped); }).detach();
        const std::vector<pid_t> processes = pool.processes();
        (void)!::write(ends_of_pipe[1], processes.data(), processes.size() * sizeof(pid_t));
        for (;;) ::pause();
    }
    std::array<pid_t, 3> processes = {};
    ASSERT_EQ(::read(ends_of_pipe[0], processes.data(), sizeof processes),
              ssize_t(sizeof processes));
    ::kill(renderer, SIGKILL);
    ::waitpid(renderer, nullptr, 0);
    for (const pid_t process : processes) EXPECT_TRUE(ends(process)) << process;
    for (const int end : ends_of_pipe) ::close(end);
}

TEST(DecoderPool, WithoutItsProgramItReadsNothing) {
    DecoderPool lone(other_program("/nowhere/velatura-decoder"));
    for (int i = 0; i < 2; ++i) {
        const Result<Image> opened = lone.open("plain", ImageUse::Texture);
        ASSERT_FALSE(opened);
        EXPECT_EQ(opened.error().message,
                  "the decoder program /nowhere/velatura-decoder is missing: No such file or "
                  "directory");
    }
    DecoderPool wrong(other_program("/bin/true"));
    EXPECT_EQ(
        wrong.open("plain", ImageUse::Texture).error().message,
        "the decoder program /bin/true cannot be started: it does not respond, or is of another "
        "version");
    DecoderPool text(other_program("/etc/hostname"));
    EXPECT_FALSE(text.open("plain", ImageUse::Texture));
    EXPECT_TRUE(children_of({::getpid()}).empty());
}

}  // namespace
}  // namespace velatura::plugins::openimageio::testing
