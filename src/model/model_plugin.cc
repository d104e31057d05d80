// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/model_plugin.h"

#include <sstream>
#include <stdexcept>

#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

bool Same(const ModelAbi& a, const ModelAbi& b) {
  return a.version == b.version && a.eigen == b.eigen && a.alignment == b.alignment &&
         a.system == b.system && a.entry == b.entry;
}

}  // namespace

std::string ToString(const ModelAbi& abi) {
  std::ostringstream text;
  text << "interface " << abi.version << ", Eigen " << abi.eigen / 10000 << "."
       << abi.eigen / 100 % 100 << "." << abi.eigen % 100 << ", alignment " << abi.alignment
       << ", sizes " << abi.system << " and " << abi.entry;
  return text.str();
}

void RegisterModelsOf(const ModelPlugin& plugin, const std::string& origin) {
  if (!Same(plugin.abi(), kModelAbi)) {
    throw std::invalid_argument(Cut(origin, 200) + " was compiled for another contact_flow (" +
                                ToString(plugin.abi()) + "; this one has " + ToString(kModelAbi) +
                                "): compile it with the headers and the -march of this one");
  }
  RegisterModels(plugin.Entries(), origin);
}

}  // namespace contact_flow
