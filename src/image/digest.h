// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::image {

/// SHA-256 over pieces.
class Sha256 {
  public:
    Sha256();
    ~Sha256();
    Sha256(const Sha256&) = delete;
    Sha256& operator=(const Sha256&) = delete;

    void add(const void* data, size_t size);

    void add(std::string_view text) { add(text.data(), text.size()); }

    void add(uint64_t number);  ///< eight bytes, little endian
    /// 64 hexadecimal digits. Call once.
    std::string finish();

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// True for channels that keep books (`sums…`) and are no image.
bool is_bookkeeping(std::string_view channel_name);

/// Digest of some channels over a window: the window, then by channel name: name, type, rows from
/// the top.
std::string digest_of(const Window& data, std::vector<const Channel*> channels);

/// Digest of channels that come in strips of rows: the window, then by channel name: name, type,
/// SHA-256 of the rows from the top.
class StripDigest {
  public:
    explicit StripDigest(const Window& data) : data_(data) {}

    /// The next rows of every channel; the same channels in the same order in every call.
    void add(std::span<const Channel* const> rows);
    /// 64 hexadecimal digits. Call once.
    std::string finish();

  private:
    struct Column {
        std::string name;
        ChannelType type = ChannelType::Half;
        Sha256 rows;
    };

    Window data_;
    std::vector<std::unique_ptr<Column>> columns_;
};

/// Digest of the image: all its channels but the bookkeeping ones as above. Equal digests mean
/// the same image, in whatever layout; attributes and compression do not count.
std::string digest_of(const Image& image);

}  // namespace velatura::image
