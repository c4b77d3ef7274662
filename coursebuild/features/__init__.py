"""What a lesson can hold and a site can offer beside the core: a folder for each feature."""
