// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/sandbox/decoder_pool.h"

#include "plugins/openimageio/sandbox/messages.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <exception>
#include <thread>
#include <utility>

namespace velatura::plugins::openimageio {

/// Place for one decoder at a time.
struct DecoderPool::Slot {
    std::mutex mutex;  // of the next three
    std::unique_ptr<DecoderProcess> decoder;
    uint64_t generation = 0;  // which decoder it is
    size_t open_images = 0;   // in that decoder
    std::atomic<pid_t> process{0};
    size_t images = 0;  // that belong here; of the pool's mutex

    Result<void> take(Result<std::unique_ptr<DecoderProcess>> started) {
        if (!started) return started.error();
        decoder = std::move(*started);
        process = decoder->process();
        ++generation;
        return {};
    }

    void drop_decoder() {
        process = 0;
        decoder.reset();
        open_images = 0;
    }
};

/// An image of the pool, in whichever decoder has its slot.
struct DecoderPool::PooledImage {
    Slot& slot;
    std::string asset;
    ImageUse use;
    uint64_t image = 0;
    uint64_t generation = 0;  // of the decoder that has opened it; 0: none
    SourceSpec spec = {};     // once it was opened
};

namespace {

/// Whether the decoder can be asked no more.
bool is_end(const Error& error) {
    return error.code.starts_with("reader-") && error.code != "reader-start";
}

Result<SourceSpec> ask_for_spec(DecoderProcess& decoder,
                                const Request& request,
                                const std::string& asset) {
    const Result<size_t> length = decoder.ask(request, {1, max_spec_bytes}, asset);
    if (!length) return length.error();
    // Copied first: what is in the area may change
    return spec_of(std::string(decoder.area().substr(0, *length)));
}

Result<void> ask_for_values(DecoderProcess& decoder,
                            const Request& request,
                            std::span<float> values) {
    const size_t bytes = values.size_bytes();
    const Result<size_t> length = decoder.ask(request, {bytes, bytes});
    if (!length) return length.error();
    std::memcpy(values.data(), decoder.area().data(), bytes);
    return {};
}

}  // namespace

class DecoderPool::OpenImage final : public SourceImage {
  public:
    OpenImage(DecoderPool& pool, PooledImage pooled) : pool_(pool), pooled_(std::move(pooled)) {}

    OpenImage(const OpenImage&) = delete;
    OpenImage& operator=(const OpenImage&) = delete;

    ~OpenImage() override {
        try {
            pool_.close(pooled_);
        } catch (const std::exception&) {
            // For want of memory: it stays open in its decoder, whose end closes it
        }
        pool_.release(pooled_.slot);
    }

    const SourceSpec& spec() const override { return pooled_.spec; }

    Result<void> open() { return pool_.read(pooled_, {}, {}); }

    Result<void> read_lines(
        int level, int y, int y_end, int channels, std::span<float> values) override {
        return pool_.read(pooled_,
                          {.kind = RequestKind::ReadLines,
                           .level = level,
                           .channels = channels,
                           .y = y,
                           .y_end = y_end},
                          values);
    }

    Result<void> read_tile(
        int level, int x, int y, int channels, std::span<float> values) override {
        return pool_.read(
            pooled_,
            {.kind = RequestKind::ReadTile, .level = level, .channels = channels, .x = x, .y = y},
            values);
    }

  private:
    DecoderPool& pool_;
    PooledImage pooled_;
};

DecoderPool::DecoderPool(PoolOptions options) : options_(std::move(options)) {
    size_t count = options_.max_decoders;
    if (count == 0) count = std::max(1u, std::thread::hardware_concurrency());
    for (size_t i = 0; i < count; ++i) slots_.push_back(std::make_unique<Slot>());
}

DecoderPool::~DecoderPool() = default;

void DecoderPool::limit(const DecoderProcessLimits& limits) {
    const std::lock_guard lock(mutex_);
    options_.limits = limits;
}

DecoderProcessLimits DecoderPool::process_limits() const {
    const std::lock_guard lock(mutex_);
    return options_.limits;
}

std::vector<pid_t> DecoderPool::processes() const {
    const std::lock_guard lock(fork_server_mutex_);
    std::vector<pid_t> all;
    if (fork_server_) all.push_back(fork_server_->process());
    for (const auto& slot : slots_)
        if (slot->process != 0) all.push_back(slot->process);
    return all;
}

DecoderPool::PooledImage DecoderPool::assign_slot(const std::string& asset, ImageUse use) {
    const std::lock_guard lock(mutex_);
    Slot& emptiest =
        **std::min_element(slots_.begin(), slots_.end(),
                           [](const auto& a, const auto& b) { return a->images < b->images; });
    ++emptiest.images;
    return {.slot = emptiest, .asset = asset, .use = use, .image = next_image_++};
}

void DecoderPool::release(Slot& slot) {
    const std::lock_guard lock(mutex_);
    --slot.images;
}

std::optional<Error> DecoderPool::failure_of(const std::string& asset) const {
    const std::lock_guard lock(mutex_);
    const auto found = failures_.find(asset);
    return found == failures_.end() ? std::nullopt : std::optional(found->second);
}

Error DecoderPool::remember(const std::string& asset, const Error& why) {
    const std::lock_guard lock(mutex_);
    return failures_.try_emplace(asset, Error{"image-read", why.message}).first->second;
}

Result<std::shared_ptr<ForkServerProcess>> DecoderPool::fork_server() {
    const std::lock_guard lock(fork_server_mutex_);
    if (fork_server_ && !fork_server_->is_lost()) return fork_server_;
    if (::access(options_.program.c_str(), X_OK) != 0)
        return Error{"reader-start", fmt::format("the decoder program {} is missing: {}",
                                                 options_.program, std::strerror(errno))};
    Result<std::shared_ptr<ForkServerProcess>> started = ForkServerProcess::start(options_.program);
    if (started) fork_server_ = *started;
    return started;
}

Result<std::unique_ptr<SourceImage>> DecoderPool::open(const std::string& asset, ImageUse use) {
    if (asset.size() > max_name_bytes) return Error{"image-open", "its name is too long"};
    auto image = std::make_unique<OpenImage>(*this, assign_slot(asset, use));
    if (const Result<void> opened = image->open(); !opened)
        return Error{"image-open", opened.error().message};
    return std::unique_ptr<SourceImage>(std::move(image));
}

Result<void> DecoderPool::ensure_open(PooledImage& pooled) {
    Slot& slot = pooled.slot;
    if (!slot.decoder) {
        const Result<std::shared_ptr<ForkServerProcess>> from = fork_server();
        if (!from) return from.error();
        const Result<void> taken = slot.take(DecoderProcess::start(*from, process_limits()));
        if (!taken) return taken;
    }
    if (pooled.generation == slot.generation) return {};
    ++slot.open_images;
    Result<SourceSpec> spec = ask_for_spec(
        *slot.decoder, {.kind = RequestKind::Open, .image = pooled.image, .use = pooled.use},
        pooled.asset);
    if (!spec) {
        if (!is_end(spec.error())) --slot.open_images;
        return spec.error();
    }
    pooled.generation = slot.generation;
    const bool is_new = pooled.spec.levels.empty();
    if (!is_new && pooled.spec != *spec)
        return remember(pooled.asset, {"image-read", "the file has changed since it was opened"});
    pooled.spec = std::move(*spec);
    return {};
}

Result<void> DecoderPool::read(PooledImage& pooled,
                               const Request& request,
                               std::span<float> values) {
    constexpr int max_attempts = 3;
    Slot& slot = pooled.slot;
    const std::lock_guard lock(slot.mutex);
    for (int attempt = 1;; ++attempt) {
        if (const std::optional<Error> failure = failure_of(pooled.asset)) return *failure;
        Result<void> done = ensure_open(pooled);
        if (done && !values.empty()) {
            Request numbered = request;
            numbered.image = pooled.image;
            done = ask_for_values(*slot.decoder, numbered, values);
        }
        if (done || !is_end(done.error())) return done;
        const std::string& code = done.error().code;
        // Another image of that decoder may have done it: the next decoder has this one alone
        const bool is_doubtful = code != "reader-slow" && attempt == 1 && slot.open_images > 1;
        slot.drop_decoder();
        const bool is_tried_again = code == "reader-lost" || is_doubtful;
        if (!is_tried_again || attempt == max_attempts) return remember(pooled.asset, done.error());
    }
}

void DecoderPool::close(const PooledImage& pooled) {
    Slot& slot = pooled.slot;
    const std::lock_guard lock(slot.mutex);
    if (!slot.decoder || pooled.generation != slot.generation) return;
    const Result<size_t> closed =
        slot.decoder->ask({.kind = RequestKind::Close, .image = pooled.image}, {0, 0});
    if (!closed && is_end(closed.error()))
        slot.drop_decoder();
    else
        --slot.open_images;
}

}  // namespace velatura::plugins::openimageio
