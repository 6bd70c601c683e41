#pragma once
// Loading of an exhibit's large models while the exhibit is shown already.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// Called while a model is loaded, on its thread, with the fraction that is done; never falls.
using LoadProgress = std::function<void(float)>;

/// As load_model of exhibit.h. `progress` may be empty; files that are not glTF report only the end.
std::shared_ptr<const Model> load_model(const std::filesystem::path& path, char up, const LoadProgress& progress);

/// Gives a loaded model to its object, at its place of the moment. Throws InputError if the model lacks what the
/// object's keys ask for.
using GiveModel = std::function<void(VirtualObject&)>;

/// An object without its model.
struct UnloadedObject {
  std::size_t index = 0;  ///< in the exhibit
  std::string name;
  /// Takes up to seconds; of the objects of one file, the first. Throws InputError.
  std::function<GiveModel(const LoadProgress&)> load;
};

/// As read_exhibit, but objects whose model files are larger are left without models, and listed in `later`.
Exhibit read_exhibit(const capture::ConfigTable& root, std::uintmax_t max_model_bytes,
                     std::vector<UnloadedObject>* later);

}  // namespace lumigraft::relight
