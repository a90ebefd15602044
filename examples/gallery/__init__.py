"""Pictures of one spacecraft in each light, taken apart from one rendering; docs/gallery.md."""
