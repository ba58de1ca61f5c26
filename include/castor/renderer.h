#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "castor/api.h"
#include "castor/denoise.h"
#include "castor/device.h"
#include "castor/device_share.h"
#include "castor/error.h"
#include "castor/film.h"
#include "castor/image_io.h"
#include "castor/scene.h"
#include "castor/tracer.h"

namespace castor {

/// The shading rules of the course's eras (scenes/README.md has the table).
enum class RuleSet { r2022, r795, r2020, r2018 };

/// "r2022", ...; rule_set_from_string throws UsageError for any other word.
CASTOR_API std::string_view to_string(RuleSet rules);
CASTOR_API RuleSet rule_set_from_string(std::string_view word);

/// How an 8-bit image of these rules is quantised.
CASTOR_API Quantization quantization(RuleSet rules);

/// How the light that comes back along eye rays is found.
enum class Integrator {
    whitted,  // from lights, mirrors and glass alone, by the format's rules (Whitted 1980)
    path,     // from everywhere, by path tracing: see PathTracing
};
/// "whitted", "path".
CASTOR_API std::string_view to_string(Integrator integrator);
CASTOR_API Integrator integrator_from_string(std::string_view word);
/// "tree", "uniform".
CASTOR_API std::string_view to_string(LightChoice choice);
CASTOR_API LightChoice light_choice_from_string(std::string_view word);

/// The weight of a sample by its distance from the pixel's centre. Sample positions are drawn in proportion to it
/// (Ernst, Stamminger, Greiner 2006, "Filter Importance Sampling"), so that a pixel depends on its own samples only.
enum class ReconstructionFilter {
    box,       // 1 pixel wide
    tent,      // 2 pixels wide
    gaussian,  // sigma 0.5 pixels, cut at 2
};
CASTOR_API std::string_view to_string(ReconstructionFilter filter);
CASTOR_API ReconstructionFilter reconstruction_filter_from_string(std::string_view word);

/// In which order the samples of a picture are taken. The finished picture is the same.
enum class RenderOrder {
    pieces,       // piece after piece, each with all of its samples: the fastest
    progressive,  // one sample of each pixel, then the next, later several at a time: for looking on
};
CASTOR_API std::string_view to_string(RenderOrder order);
CASTOR_API RenderOrder render_order_from_string(std::string_view word);

/// Which points the samples of a pixel have: where they lie in it, and of each random choice.
enum class SampleOrder {
    pixel,  // each pixel has a sequence of its own: noise that is independent from pixel to pixel
    z,      // pixels share one sequence, along a Z curve over the picture: noise whose sum over some pixels is small
};
CASTOR_API std::string_view to_string(SampleOrder order);
CASTOR_API SampleOrder sample_order_from_string(std::string_view word);

/// A share of a picture: some of its blocks of pixels, from all over it. Parts with the same `count` have each block
/// once. Usable by several programs, on several computers: merge_checkpoints joins what they leave.
struct PicturePart {
    std::uint32_t number = 1;  // 1 ... count
    std::uint32_t count = 1;
};

/// Lights whose share of a path-traced picture becomes a plane of its own.
struct LightGroup {
    std::string name;                   // of letters, digits, '-' and '_'
    std::vector<std::uint32_t> lights;  // indices in Scene::lights, each in one group at most
};

struct CASTOR_API RenderOptions {
    std::uint32_t samples_per_pixel = 0;  // 0: the camera's own number. One sample goes through the pixel's centre.
    // Empty: gaussian; but box, the format's own, where the number of samples is the camera's.
    std::optional<ReconstructionFilter> filter = {};
    RuleSet rules = RuleSet::r2022;
    bool cull_back_faces = false;  // for camera and mirror rays, flat triangles only; r795 does so in any case
    std::optional<std::uint32_t> max_recursion_depth{};  // empty: the scene's
    // Empty: path where the camera says so or the scene has principled materials, else whitted.
    std::optional<Integrator> integrator{};
    // Of path tracing, in place of what the camera's PathTracing says:
    std::optional<std::uint32_t> bounces{};  // at most CASTOR_MOST_BOUNCES, 1024
    std::optional<float> largest_sample{};
    std::optional<LightChoice> light_choice{};
    // A device renders at most as many pixels at a time as a square of this edge has, a multiple of 8; 0: what suits
    // the device. Does not change the picture.
    std::uint32_t tile_size = 0;
    std::uint32_t seed = 0;
    // With `z`, points suit the number of samples that is asked for, best a power of two, and depend on it: pictures
    // and blocks that stop before have others than with that number.
    SampleOrder sample_order = SampleOrder::pixel;
    // Planes to make beside the picture: names of aov_names(). "lights" stands for a plane for each light, with what
    // the picture would be by this light alone: what surfaces reflect of it, also seen in mirrors and through glass;
    // and for a last one of all else: ambient light, what is emitted, the background, and environments where they are
    // seen. Their sum is the picture but for rounding. Each is a render of its own after the picture's; none can be
    // made of a part, with a checkpoint, in a picture that is verified, or by several processes.
    std::vector<std::string> aovs{};
    // Of a path-traced picture: each becomes a plane "group-NAME" with the light that comes from its lights, on
    // whatever way, and what surfaces that are its lights show of themselves. One more, "group-rest", has all other
    // light: that of other lights, of materials that emit and are no lights, and the background. The planes' sum is the
    // picture but for rounding, and its bytes are the same as without. At most 31.
    std::vector<LightGroup> light_groups{};
    // Whether to remove noise from the picture when it is complete (denoise.h). The planes that this takes are made,
    // and left out of the film unless `aovs` names them; "noisy" is the picture as it was. Castor's own denoiser takes
    // two samples a pixel. Open Image Denoise is looked for before the render begins, where it is not one of a part.
    bool denoise = false;
    Denoiser denoiser = Denoiser::castor;  // that `denoise` uses; of the bits of `oidn`, see denoise_by_oidn
    // The picture is complete after the first pass over it that ends so many seconds or more after the render's begin,
    // with as many samples as each pixel then has, which Film::samples_per_pixel tells: in progressive order. The film
    // has the same bytes as if that number, of two or more, had been asked for, except that textures of path-traced
    // pictures are as fine as suits all samples. Not of a part, with a checkpoint, with planes of lights, or in a
    // picture that is verified. Empty: all samples are taken.
    std::optional<double> stop_after_seconds{};
    // The error at which blocks of 8x8 pixels stop: each is done after 16, 32, 64 ... samples a pixel, if its estimated
    // error is this or less then, relative to the block's mean luminance, or to a hundredth of white where that is
    // more: 0.01 is one per cent. The error is the root of the mean of the variances of its pixels' means (Dammertz and
    // others 2010). It is an estimate of a block's own samples, and sees no light that they did not find. A block has
    // the bytes of a picture with as many samples, except for textures, as above; the plane "samples" tells how many.
    // Takes more than 16 samples a pixel. Not with planes of lights. Empty: blocks take all samples.
    std::optional<double> noise{};
    // Where what is done is kept every so many seconds, and at the end if it is not all: finished pieces, and the sums
    // of samples of others. Empty: nowhere. A file that cannot be written is told of, and the render goes on.
    std::filesystem::path checkpoint_file{};
    double checkpoint_seconds = 60.0;
    // What is done already. Empty: nothing. The picture is the same bytes as if it had been made at once, whatever the
    // devices were.
    std::filesystem::path resume_file{};
    // The share of the picture, up to 1, that is made once more when it is done, each part on another device than
    // before, to compare the bits. Needs two devices. 0: nothing.
    double verify_share = 0.0;
    RenderOrder order = RenderOrder::pieces;
    // Only these pixels are rendered; empty: all. What `resume_file` has of others stays as it is. The checkpoint is
    // then written at the end also if all is done.
    std::optional<PicturePart> part = {};

    /// `filter`, or what an empty one stands for.
    ReconstructionFilter filter_in_use() const;
    /// How a camera's picture is path traced; empty: it is not.
    std::optional<PathTracing> path_tracing_in_use(const Camera& camera) const;
};

/// The planes that a render can make, in the order of the documentation.
CASTOR_API const std::vector<std::string>& aov_names();

/// The names of the planes of RenderOptions::light_groups.
CASTOR_API std::vector<std::string> light_group_planes(const std::vector<LightGroup>& groups);

/// The planes that a film of this scene gets for these names of aov_names(): the same, but in place of "lights" at the
/// end "light-0-point" ..., by the number in Scene::lights and the kind, and "light-none".
CASTOR_API std::vector<std::string> plane_names(const Scene& scene, const std::vector<std::string>& aovs);

struct RenderProgress {
    std::uint64_t samples_done = 0;
    std::uint64_t samples_total = 0;    // becomes less where blocks stop (RenderOptions::noise)
    std::uint64_t samples_resumed = 0;  // of those that are done: they were when the render began
    std::uint64_t rays = 0;             // of all kinds, traced for finished pieces so far
    double seconds = 0.0;               // since the render began
    std::vector<DeviceShare> devices;
    // Since the last call: devices that were dropped, checkpoints that could not be written.
    std::vector<std::string> notices;
    // Copies the film as it is now: pixels that are not done have the means of the samples that devices have given
    // back, or (0, 0, 0). Each call also asks the devices to give back what they have, for the next one. May be called
    // only while the callback runs.
    std::function<Film()> snapshot;
};

/// Called some fifty times a second by the thread that renders. Returning false stops the render soon; the film then
/// has what is done.
using ProgressCallback = std::function<bool(const RenderProgress&)>;

/// The last device failed. `film` has what was done by then.
class CASTOR_API RenderError : public DeviceError {
public:
    RenderError(const DeviceError& failure, Film film) : DeviceError(failure), film_(std::move(film)) {}
    const Film& film() const { return film_; }

private:
    Film film_;
};

/// Where two devices gave different bits.
struct PixelDifference {
    std::uint32_t x = 0, y = 0;
    std::string channel;  // "R", "G", "B", or a plane's name and channel such as "normal.X"
    std::array<std::string, 2> devices;
    std::array<double, 2> values{};
    std::uint64_t distance = 0;  // in units in the last place; of indices their difference
};

/// What came of RenderOptions::verify_share.
struct Verification {
    std::uint64_t pixels = 0;  // that were made twice
    std::uint64_t differing_pixels = 0;
    std::string gap;                       // why not all that was to be compared was; empty: it was
    std::optional<PixelDifference> first;  // in the order of rows; none: all bits are equal
};

struct RenderStatistics {
    double flatten_seconds = 0.0;
    double build_seconds = 0.0;  // the tree
    double setup_seconds = 0.0;  // programs and uploads
    double render_seconds = 0.0;
    double denoise_seconds = 0.0;                              // of RenderOptions::denoise; 0: noise was not removed
    std::uint32_t oidn_version = 0;                            // of what removed it (denoise.h); 0: it was Castor
    std::uint64_t rays = 0;                                    // of all kinds: eye, shadow and mirror
    std::uint64_t samples_done = 0;                            // of all pixels, those that are in the picture
    std::uint64_t samples_resumed = 0;                         // of them, those that RenderOptions::resume_file had
    std::map<std::uint32_t, std::uint64_t> pixels_by_samples;  // number of pixels that are done with so many samples
    bool part_complete = false;  // all samples of RenderOptions::part are done, and of planes of lights
    std::uint64_t triangles = 0, spheres = 0, planes = 0, nodes = 0;
    // As which rays those of the eye, and shadow rays from what they met, were traced in the last render: as others,
    // where there are so few that it is not worth compiling kernels for them.
    Coherence eye_rays = Coherence::coherent;
    std::vector<DeviceShare> devices;  // in the constructor's order, also those that were dropped
    std::vector<std::string> notices;  // all of the last render
    Verification verification;
};

struct RendererOptions {
    Strategy strategy = Strategy::automatic;
    TreeQuality quality = TreeQuality::medium;
    bool use_profiles =
        true;  // what `castor tune` stored for the devices; may make renders faster, does not change the picture
    double deadline_seconds = 300.0;  // a device that does not answer for so long is dropped
    // One that does not answer for so long, once the picture is done or the render is being stopped, is not waited for:
    // its thread goes on by itself, and ends when the device answers. A device answers twice to some twenty times a
    // second, but while its driver compiles kernels. A program that sets less must not end as long as such threads run.
    double stop_deadline_seconds = 300.0;
    SceneShare scene_share{};  // the chunks that stay on the devices, if not all; does not change the picture
};

class Manager;
class RankServer;

/// Renders pictures of one scene on all of its devices: each gets as much as it can do. A device that fails is dropped,
/// and the others do its work; only where none is left does a DeviceError reach the caller. Kernels and buffers are
/// kept from one render to the next, which may have another camera, size or number of samples. Usable from several
/// threads; renders take turns.
class CASTOR_API Renderer {
public:
    /// Flattens the scene, builds its tree and uploads both to every device, once.
    /// Throws SceneError, DeviceError, UsageError (no device).
    Renderer(const Scene& scene, const std::vector<Device>& devices, const RendererOptions& options = {});
    /// The same of a scene that is built already, and is kept: only a tree that it has not is built, with a warning.
    Renderer(const BuiltScene& scene, const std::vector<Device>& devices, const RendererOptions& options = {});
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    /// Renders what the camera sees. Throws SceneError if the camera is wrong (a zero gaze, up parallel to it, no
    /// pixels, more than 65536 in a direction), UsageError for an unknown AOV, a bad option or part, SceneError for a
    /// resume_file that is damaged or of another picture, RenderError.
    Film render(const Camera& camera, const RenderOptions& options = {}, const ProgressCallback& on_progress = {});

    /// What the constructor noticed and went on, beside Scene::warnings: degenerate triangles, lamps that light
    /// otherwise than they are seen, device profiles that cannot be used, devices that failed.
    const std::vector<Warning>& warnings() const;
    /// Of the constructor and the last render.
    RenderStatistics statistics() const;
    /// The strategy of eye rays and shadow rays from what they met (see RenderStatistics::eye_rays), or of others, on
    /// the device_index-th device that the constructor was given.
    Strategy strategy(Coherence hint = Coherence::coherent, Query query = Query::closest,
                      std::size_t device_index = 0) const;

private:
    struct CASTOR_HIDDEN Implementation;
    // The library's own: work with, and for, other processes.
    friend Film render_together(Renderer&, const Camera&, const RenderOptions&, const ProgressCallback&, Manager&);
    friend bool serve_render(Renderer&, const Camera&, const RenderOptions&, RankServer&);

    std::unique_ptr<Implementation> implementation_;
};

}  // namespace castor
