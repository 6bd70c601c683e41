#pragma once
// Receives the body of a request into a file, chunk by chunk. Files are written on a thread of their own, so that a
// slow disk delays no viewer; the next chunk is read when the last one is written.
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace lumigraft::server {

enum class UploadEnd { received, disconnected, not_written };

/// Removes its file when it is destroyed, unless the file was moved away.
template <typename Stream>
class Upload : public std::enable_shared_from_this<Upload<Stream>> {
 public:
  using Header = boost::beast::http::request_parser<boost::beast::http::empty_body>;
  using Done = std::function<void(UploadEnd)>;

  /// What is referred to must exist until `done` was called, on the thread of `io`. Without a chunk for `patience` the
  /// client counts as gone. `max_bytes` bounds bodies that do not state their length.
  Upload(Header&& header, std::filesystem::path file, std::uint64_t max_bytes, std::chrono::milliseconds patience,
         Stream& stream, boost::beast::flat_buffer& buffer, boost::asio::io_context& io,
         boost::asio::thread_pool& file_thread)
      : parser_(std::move(header)),
        file_(std::move(file)),
        out_(std::fopen(file_.c_str(), "wbx"), &std::fclose),
        patience_(patience),
        stream_(stream),
        buffer_(buffer),
        io_(io),
        file_thread_(file_thread) {
    parser_.body_limit(max_bytes);
  }
  ~Upload() {
    std::error_code ignored;
    if (mine_) std::filesystem::remove(file_, ignored);
  }
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  void start(Done done) {
    done_ = std::move(done);
    mine_ = out_ != nullptr;
    if (!mine_) return done_(UploadEnd::not_written);
    next();
  }
  const std::filesystem::path& file() const { return file_; }

 private:
  void next() {
    if (parser_.is_done()) return finish();
    parser_.get().body().data = chunk_.data();
    parser_.get().body().size = chunk_.size();
    boost::beast::get_lowest_layer(stream_).expires_after(patience_);
    boost::beast::http::async_read(stream_, buffer_, parser_,
                                   [self = this->shared_from_this()](boost::system::error_code error, std::size_t) {
                                     if (error && error != boost::beast::http::error::need_buffer)
                                       return self->done_(UploadEnd::disconnected);
                                     self->write(self->chunk_.size() - self->parser_.get().body().size);
                                   });
  }

  void write(std::size_t bytes) {
    boost::asio::post(file_thread_, [self = this->shared_from_this(), bytes] {
      const bool written = std::fwrite(self->chunk_.data(), 1, bytes, self->out_.get()) == bytes;
      boost::asio::post(self->io_, [self, written] { written ? self->next() : self->done_(UploadEnd::not_written); });
    });
  }

  void finish() {
    boost::asio::post(file_thread_, [self = this->shared_from_this()] {
      const bool written = std::fclose(self->out_.release()) == 0;
      boost::asio::post(self->io_,
                        [self, written] { self->done_(written ? UploadEnd::received : UploadEnd::not_written); });
    });
  }

  boost::beast::http::request_parser<boost::beast::http::buffer_body> parser_;
  std::filesystem::path file_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> out_;
  bool mine_ = false;
  std::vector<char> chunk_ = std::vector<char>(256 * 1024);
  std::chrono::milliseconds patience_;
  Stream& stream_;
  boost::beast::flat_buffer& buffer_;
  boost::asio::io_context& io_;
  boost::asio::thread_pool& file_thread_;
  Done done_;
};

}  // namespace lumigraft::server
