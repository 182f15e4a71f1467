#include "opencv.hpp"

#if defined(NOOK_COMPARE_OPENCV)

#include <memory>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace compare {

namespace {

/// OpenCV has no view of constant data; it only reads this one.
cv::Mat matrix(const Depth& depth)
{
    return {depth.height, depth.width, CV_32F, const_cast<float*>(depth.data)};
}

}  // namespace

std::string opencv_version() { return CV_VERSION; }

std::vector<Contender> opencv_contenders(const Depth& depth, const Visibility& visibility,
                                         int window, const Kernels& kernels)
{
    cv::setNumThreads(1);
    struct Moments {
        cv::Mat first, second;
    };
    const std::size_t pixels =
        static_cast<std::size_t>(depth.width) * static_cast<std::size_t>(depth.height);
    const cv::Mat input = matrix(depth);
    const auto boxes = [=, &kernels, moments = std::make_shared<Moments>()] {
        cv::boxFilter(input, moments->first, CV_32F, {window, window});
        cv::sqrBoxFilter(input, moments->second, CV_32F, {window, window});
        kernels.shade_moments(depth.data, moments->first.ptr<float>(), moments->second.ptr<float>(),
                              visibility.data, pixels);
    };
    const auto tables = [=, &kernels, moments = std::make_shared<Moments>()] {
        cv::integral(input, moments->first, moments->second, CV_64F, CV_64F);
        kernels.shade_tables(depth, {moments->first.ptr<double>(), moments->second.ptr<double>()},
                             window, visibility);
    };
    return {{"OpenCV boxes", boxes}, {"OpenCV integral", tables}};
}

}  // namespace compare

#else

namespace compare {

std::string opencv_version() { return {}; }

std::vector<Contender> opencv_contenders(const Depth&, const Visibility&, int, const Kernels&)
{
    return {};
}

}  // namespace compare

#endif
