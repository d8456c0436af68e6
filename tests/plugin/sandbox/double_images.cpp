// SPDX-License-Identifier: Apache-2.0
#include "double_images.h"

#include "base/hash.h"
#include "plugins/openimageio/sandbox/messages.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

namespace velatura::plugins::openimageio::testing {

namespace {

bool is_poisoned = false;

void take_all_memory() {
    std::vector<std::vector<char>> all;
    for (;;) all.emplace_back(size_t(64) << 20, 'x');
}

void answer_nonsense() {
    const Reply nonsense = {.bytes = 5};
    for (int fd = 3; fd < 64; ++fd) (void)::send(fd, &nonsense, sizeof nonsense, MSG_NOSIGNAL);
}

/// Ends the process where the system lets it do what decoders must not.
void expect_refused(bool is_refused) {
    if (!is_refused || errno != EPERM) std::abort();
}

void try_what_is_forbidden(std::string_view what) {
    const char* const file = "/dev/shm/velatura_double";
    const rlimit no_limit = {RLIM_INFINITY, RLIM_INFINITY};
    if (what == "write") expect_refused(::open(file, O_WRONLY | O_CREAT, 0600) < 0);
    if (what == "remove") expect_refused(::unlink(file) < 0);
    if (what == "socket") expect_refused(::socket(AF_INET, SOCK_STREAM, 0) < 0);
    if (what == "fork") expect_refused(::fork() < 0);
    if (what == "signal") expect_refused(::kill(::getppid(), 0) < 0);
    if (what == "limit") expect_refused(::setrlimit(RLIMIT_FSIZE, &no_limit) < 0);
    if (what == "thread") std::thread([] {}).join();
}

void crash() {
    // Sanitizers have a handler of their own
    std::signal(SIGSEGV, SIG_DFL);
    std::raise(SIGSEGV);
}

void do_to_oneself(std::string_view what) {
    if (what == "segv" || (is_poisoned && what != "poison")) crash();
    if (what == "kill") std::raise(SIGKILL);
    if (what == "abort") std::abort();
    if (what == "exit") ::_exit(7);
    if (what == "stop") std::raise(SIGSTOP);
    if (what == "memory") take_all_memory();
    if (what == "throw") throw std::runtime_error("thrown\x1b[31m by a decoder");
    if (what == "poison") is_poisoned = true;
    if (what == "liar") answer_nonsense();
    try_what_is_forbidden(what);
    const double limit_s = what == "spin" ? 1e9 : what == "busy" ? 0.2 : 0;
    for (const std::clock_t begin = std::clock();
         double(std::clock() - begin) < limit_s * CLOCKS_PER_SEC;) {
    }
}

class DoubleImage final : public SourceImage {
  public:
    explicit DoubleImage(std::string asset) : asset_(std::move(asset)) {
        const bool is_of_scene = asset_.ends_with(".png");
        const size_t folder = is_of_scene ? asset_.rfind('/') + 1 : 0;
        const size_t end = asset_.find(is_of_scene ? '.' : '/', folder);
        const std::string_view name = std::string_view(asset_).substr(folder, end - folder);
        what_ = name.substr(0, name.find(':'));
        if (name.ends_with(":open"))
            do_to_oneself(what_);
        else
            at_reading_ = what_;
        LevelSpec level;
        level.width = level.full_width = DoubleImages::width;
        level.height = level.full_height = DoubleImages::height;
        if (what_ == "other") level.full_height += ::getpid();
        level.channels = DoubleImages::channels;
        level.is_flat = 1;
        spec_.levels.push_back(level);
        // Textures are tiled at all levels or at none
        if (is_of_scene) return;
        level.tile_width = level.tile_height = DoubleImages::tile;
        spec_.levels.push_back(level);
    }

    const SourceSpec& spec() const override { return spec_; }

    Result<void> read_lines(int, int y, int y_end, int channels, std::span<float> values) override {
        return read(0, y, DoubleImages::width, y_end, channels, values);
    }

    Result<void> read_tile(int, int x, int y, int channels, std::span<float> values) override {
        return read(x, y, x + DoubleImages::tile, y + DoubleImages::tile, channels, values);
    }

  private:
    Result<void> read(int x, int y, int x_end, int y_end, int channels, std::span<float> values) {
        do_to_oneself(at_reading_);
        if (what_ == "refused") return Error{"image-read", "this one never"};
        size_t i = 0;
        for (int row = y; row < y_end; ++row)
            for (int column = x; column < x_end; ++column)
                for (int c = 0; c < channels; ++c)
                    values[i++] = DoubleImages::value(asset_, column, row, c);
        return {};
    }

    std::string asset_;
    std::string_view what_, at_reading_;
    SourceSpec spec_;
};

}  // namespace

float DoubleImages::value(const std::string& asset, int x, int y, int channel) {
    const uint64_t place = uint64_t(x) << 40 | uint64_t(y) << 8 | uint64_t(channel);
    return float(mix64(place ^ uint64_t(asset.size()) << 56 ^ uint64_t(asset.back())) >> 40);
}

std::vector<float> DoubleImages::lines(const std::string& asset, int y, int y_end) {
    std::vector<float> values;
    for (int row = y; row < y_end; ++row)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c) values.push_back(value(asset, x, row, c));
    return values;
}

Result<std::unique_ptr<SourceImage>> DoubleImages::open(const std::string& asset, ImageUse) {
    if (asset.starts_with("missing")) return Error{"image-open", "there is no " + asset};
    return std::unique_ptr<SourceImage>(new DoubleImage(asset));
}

}  // namespace velatura::plugins::openimageio::testing
