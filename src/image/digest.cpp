// SPDX-License-Identifier: Apache-2.0
#include "image/digest.h"

#include "base/check.h"
#include "base/tasks.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <new>

namespace velatura::image {

struct Sha256::Impl {
    EVP_MD_CTX* context = EVP_MD_CTX_new();

    ~Impl() { EVP_MD_CTX_free(context); }
};

// OpenSSL always has this one: it fails for want of memory alone
Sha256::Sha256() : impl_(std::make_unique<Impl>()) {
    if (!impl_->context || EVP_DigestInit_ex(impl_->context, EVP_sha256(), nullptr) != 1)
        throw std::bad_alloc();
}

Sha256::~Sha256() = default;

void Sha256::add(const void* data, size_t size) {
    VELATURA_CHECK(EVP_DigestUpdate(impl_->context, data, size) == 1, "SHA-256 failed");
}

void Sha256::add(uint64_t number) {
    std::array<unsigned char, 8> bytes{};
    for (size_t i = 0; i < bytes.size(); ++i)
        bytes[i] = static_cast<unsigned char>(number >> (8 * i));
    add(bytes.data(), bytes.size());
}

std::string Sha256::finish() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> bytes{};
    unsigned int size = 0;
    VELATURA_CHECK(EVP_DigestFinal_ex(impl_->context, bytes.data(), &size) == 1, "SHA-256 failed");
    constexpr std::string_view digits = "0123456789abcdef";
    std::string text;
    for (size_t i = 0; i < size; ++i) {
        text += digits[bytes[i] >> 4];
        text += digits[bytes[i] & 15];
    }
    return text;
}

namespace {

void add_window(Sha256& sha, const Window& w) {
    for (const int v : {w.x0, w.y0, w.x1, w.y1}) sha.add(uint64_t(uint32_t(v)));
}

void add_channels(Sha256& sha, std::vector<const Channel*> channels) {
    std::stable_sort(channels.begin(), channels.end(),
                     [](const Channel* a, const Channel* b) { return a->name < b->name; });
    for (const Channel* c : channels) {
        sha.add(c->name);
        sha.add(uint64_t(c->type()));
        // Channel values are little endian on every machine that Velatura runs on
        sha.add(c->bytes(), c->byte_count());
    }
}

}  // namespace

bool is_bookkeeping(std::string_view channel_name) {
    return channel_name.starts_with("sums");
}

std::string digest_of(const Window& data, std::vector<const Channel*> channels) {
    Sha256 sha;
    add_window(sha, data);
    add_channels(sha, std::move(channels));
    return sha.finish();
}

void StripDigest::add(std::span<const Channel* const> rows) {
    for (size_t i = columns_.size(); i < rows.size(); ++i) {
        columns_.push_back(std::make_unique<Column>());
        columns_[i]->name = rows[i]->name;
        columns_[i]->type = rows[i]->type();
    }
    VELATURA_CHECK(columns_.size() == rows.size(), "a strip has other channels than the first");
    parallel_for(rows.size(), [&](size_t i) {
        VELATURA_CHECK(columns_[i]->name == rows[i]->name && columns_[i]->type == rows[i]->type(),
                       "a strip has other channels than the first");
        columns_[i]->rows.add(rows[i]->bytes(), rows[i]->byte_count());
    });
}

std::string StripDigest::finish() {
    std::stable_sort(columns_.begin(), columns_.end(),
                     [](const auto& a, const auto& b) { return a->name < b->name; });
    Sha256 sha;
    add_window(sha, data_);
    for (const auto& column : columns_) {
        sha.add(column->name);
        sha.add(uint64_t(column->type));
        sha.add(column->rows.finish());
    }
    return sha.finish();
}

std::string digest_of(const Image& image) {
    std::vector<const Channel*> channels;
    for (const Part& part : image.parts) {
        for (const Channel& c : part.channels) {
            if (!is_bookkeeping(c.name)) channels.push_back(&c);
        }
    }
    return digest_of(image.data, std::move(channels));
}

}  // namespace velatura::image
