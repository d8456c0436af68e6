// SPDX-License-Identifier: Apache-2.0
// An accelerator that loads and cannot be built, as when a library runs out of memory.
#include "accel/accelerator_factory.h"
#include "plugin/plugin_api.h"

namespace {

using namespace velatura;

class RefusingFactory final : public accel::AcceleratorFactory {
  public:
    Result<std::unique_ptr<accel::Accelerator>> build(const accel::SoupScene&) const override {
        return Error{"accelerator", "no memory for the test"};
    }
};

const RefusingFactory factory;
const plugin::InterfaceEntry interfaces[] = {
    {accel::accelerator_interface, accel::accelerator_interface_version,
     static_cast<const accel::AcceleratorFactory*>(&factory)}};
const plugin::PluginInfo info = {plugin::abi_version, "refusing", interfaces, 1};

}  // namespace

extern "C" [[gnu::visibility("default")]] const plugin::PluginInfo* velatura_plugin_v1();

const plugin::PluginInfo* velatura_plugin_v1() {
    return &info;
}
