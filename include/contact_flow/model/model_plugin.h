// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/model_registry.h"

namespace contact_flow {

/// What a library of models and the program that loads it have to agree about. They are compiled
/// apart: other headers, or other flags of the compiler, may give the same types another layout.
struct ModelAbi {
  int version;         ///< of the interface, raised when MechanicalSystem changes its meaning
  int eigen;           ///< 30400 for Eigen 3.4.0
  int alignment;       ///< EIGEN_MAX_ALIGN_BYTES, which -march decides [bytes]
  std::size_t system;  ///< of MechanicalSystem and its description together [bytes]
  std::size_t entry;   ///< of ModelEntry [bytes]
};

/// That of the headers and flags of this translation unit. It has internal linkage on purpose: a
/// symbol that libraries share would be that of the library which is loaded first.
static constexpr ModelAbi kModelAbi = {
    1, EIGEN_WORLD_VERSION * 10000 + EIGEN_MAJOR_VERSION * 100 + EIGEN_MINOR_VERSION,
    EIGEN_MAX_ALIGN_BYTES, sizeof(MechanicalSystem) + sizeof(SystemDescription),
    sizeof(ModelEntry)};

/// "interface 1, Eigen 3.4.0, alignment 16, sizes 600 and 64"
std::string ToString(const ModelAbi& abi);

/// What a shared library of models offers. It derives from this class and, to be found by
/// contact_flow_node, is exported by pluginlib:
///
///     class Models : public contact_flow::ModelPlugin {
///       std::vector<contact_flow::ModelEntry> Entries() const override {
///         return {contact_flow::EntryOf<DroppedBall>()};
///       }
///     };
///     PLUGINLIB_EXPORT_CLASS(my_models::Models, contact_flow::ModelPlugin)
class ModelPlugin {
 public:
  /// The default argument is evaluated where the derived class is compiled: in the library.
  explicit ModelPlugin(ModelAbi abi = kModelAbi) : abi_(abi) {}
  ModelPlugin(const ModelPlugin&) = delete;
  ModelPlugin& operator=(const ModelPlugin&) = delete;
  virtual ~ModelPlugin() = default;

  /// The models. Their factories are used as long as the process runs.
  virtual std::vector<ModelEntry> Entries() const = 0;

  /// What the library was compiled with.
  const ModelAbi& abi() const { return abi_; }

 private:
  const ModelAbi abi_;  // first of all members, in every version
};

/// RegisterModels of its entries, from `origin`. Throws std::invalid_argument, before it calls the
/// library, where its ABI is not that of this program.
void RegisterModelsOf(const ModelPlugin& plugin, const std::string& origin);

}  // namespace contact_flow
