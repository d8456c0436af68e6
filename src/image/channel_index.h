// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

#include <string_view>
#include <unordered_map>

namespace velatura::image {

/// Channels by full name, of several with one name the first: files with exact sums have thousands.
/// Holds no copies: the channels must stay where they are.
class ChannelIndex {
  public:
    explicit ChannelIndex(const Image& image);

    explicit ChannelIndex(const Part& part) { add(part); }

    /// Null if there is none.
    const Channel* find(std::string_view name) const;

  private:
    void add(const Part& part);

    std::unordered_map<std::string_view, const Channel*> channels_;
};

}  // namespace velatura::image
