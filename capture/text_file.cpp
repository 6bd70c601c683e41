#include "capture/text_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>

#include "capture/descriptor.h"
#include "capture/error.h"

namespace lumigraft::capture {

void write_text(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path partial = file.string() + ".partial";
  std::ofstream out(partial);
  out << text;
  out.close();
  if (!out) throw std::runtime_error(partial.string() + ": cannot be written, the disk may be full");
  // Else a machine that loses its power soon after may have the new name and no text.
  const Descriptor written(open(partial.c_str(), O_WRONLY | O_CLOEXEC));
  if (fsync(written.number()) != 0) throw std::runtime_error(partial.string() + ": cannot be written to the disk");
  std::filesystem::rename(partial, file);
}

void make_out_folder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  refuse_if(fs::exists(folder) && (!fs::is_directory(folder) || !fs::is_empty(folder, error)),
            "--out: found " + folder.string() + " in use, allowed: a folder that is new or empty");
  fs::create_directories(folder, error);
  if (error) throw InputError("--out: " + folder.string() + ": " + error.message());
}

}  // namespace lumigraft::capture
