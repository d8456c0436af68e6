// SPDX-License-Identifier: Apache-2.0
#include "image/channel_index.h"

namespace velatura::image {

ChannelIndex::ChannelIndex(const Image& image) {
    for (const Part& part : image.parts) add(part);
}

void ChannelIndex::add(const Part& part) {
    for (const Channel& c : part.channels) channels_.emplace(c.name, &c);
}

const Channel* ChannelIndex::find(std::string_view name) const {
    const auto at = channels_.find(name);
    return at == channels_.end() ? nullptr : at->second;
}

}  // namespace velatura::image
