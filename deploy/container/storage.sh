# SPDX-License-Identifier: Apache-2.0
# Where deploy/container/build keeps images, and deploy/test-container finds them: nothing outside build. To be sourced after
# deploy/steps.sh.
folder=$root/build/container
mkdir -p "$folder"
buildah() { command buildah --root "$folder/storage" --runroot "$folder/run" --storage-driver vfs "$@"; }
